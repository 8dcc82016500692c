// Fields of halide_buffer_t.
#include <HalideRuntime.h>

#include "codegen/function_generator.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

static_assert(sizeof(halide_type_t) == 4 && sizeof(halide_dimension_t) == 16);

bool FunctionGenerator::is_buffer_operator(Op op) const {
  return op >= Op::buffer_host && op <= Op::buffer_is_query;
}

// Pixels never overlap the descriptors, so their stores do not force these loads to be repeated.
Value* FunctionGenerator::buffer_field(Value* buffer, llvm::Type* type, int64_t offset) {
  Value* pointer = b_.CreateConstGEP1_64(b_.getInt8Ty(), buffer, static_cast<uint64_t>(offset));
  auto* load = b_.CreateLoad(type, pointer);
  load->setMetadata(llvm::LLVMContext::MD_tbaa, alias_tag("buffer descriptors"));
  return load;
}

Value* FunctionGenerator::dimension_pointer(Value* buffer, Value* dimension, int64_t offset) {
  Value* dims = buffer_field(buffer, b_.getPtrTy(), offsetof(halide_buffer_t, dim));
  Value* index = b_.CreateIntCast(dimension, b_.getInt64Ty(), true);
  Value* bytes =
      b_.CreateAdd(b_.CreateMul(index, int64(sizeof(halide_dimension_t))), int64(offset));
  return b_.CreateGEP(b_.getInt8Ty(), dims, bytes);
}

// Null for a null buffer, without a branch: the address that is read is then that of a constant.
Value* FunctionGenerator::host_pointer(Value* buffer) {
  auto* type = b_.getPtrTy();
  auto* zero = e_.module.getGlobalVariable("no_host", true);
  if (!zero) {
    zero = new llvm::GlobalVariable(e_.module, type, true, llvm::GlobalValue::PrivateLinkage,
                                    null_pointer(), "no_host");
  }
  Value* field = b_.CreateConstGEP1_64(b_.getInt8Ty(), buffer, offsetof(halide_buffer_t, host));
  auto* load = b_.CreateLoad(
      type, b_.CreateSelect(b_.CreateICmpEQ(buffer, null_pointer()), zero, field), "host");
  load->setMetadata(llvm::LLVMContext::MD_tbaa, alias_tag("buffer descriptors"));
  return load;
}

Value* FunctionGenerator::buffer_operator(const Call& e) {
  Value* buffer = value(e.args[0]);
  const auto dimension_field = [&](int64_t offset) -> Value* {
    auto* load =
        b_.CreateLoad(b_.getInt32Ty(), dimension_pointer(buffer, value(e.args[1]), offset));
    load->setMetadata(llvm::LLVMContext::MD_tbaa, alias_tag("buffer descriptors"));
    return convert(e_, e.type, Int(32), load);
  };
  const auto int_field = [&](int64_t offset) {
    return convert(e_, e.type, UInt(32), buffer_field(buffer, b_.getInt32Ty(), offset));
  };
  switch (e.op) {
    case Op::buffer_host:
      return host_pointer(buffer);
    case Op::buffer_min:
      return dimension_field(offsetof(halide_dimension_t, min));
    case Op::buffer_extent:
      return dimension_field(offsetof(halide_dimension_t, extent));
    case Op::buffer_stride:
      return dimension_field(offsetof(halide_dimension_t, stride));
    case Op::buffer_dimensions:
      return int_field(offsetof(halide_buffer_t, dimensions));
    case Op::buffer_type:
      return int_field(offsetof(halide_buffer_t, type));
    case Op::buffer_is_null:
      return b_.CreateICmpEQ(buffer, null_pointer());
    case Op::buffer_is_query: {
      Value* device = buffer_field(buffer, b_.getInt64Ty(), offsetof(halide_buffer_t, device));
      return b_.CreateAnd(b_.CreateICmpEQ(host_pointer(buffer), null_pointer()),
                          b_.CreateICmpEQ(device, b_.getInt64(0)));
    }
    default:
      internal_error("no such buffer operator");
  }
}

}  // namespace retrograde::codegen
