// Loads and stores of the fields of halide_buffer_t.
#include <HalideRuntime.h>

#include "codegen/values/calls.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

static_assert(sizeof(halide_type_t) == 4 && sizeof(halide_dimension_t) == 16);

bool is_buffer_operator(Op op) { return op >= Op::buffer_host && op <= Op::buffer_is_query; }

// Stores to pixels never alias the descriptors, so they do not force LLVM to reload these fields.
static Value* load_field(FunctionContext& c, llvm::Type* type, Value* pointer,
                         const char* name = "") {
  auto* load = c.b.CreateLoad(type, pointer, name);
  load->setMetadata(llvm::LLVMContext::MD_tbaa, alias_tag(c.e, "buffer descriptors"));
  return load;
}

static Value* buffer_field(FunctionContext& c, Value* buffer, llvm::Type* type, uint64_t offset) {
  return load_field(c, type, c.b.CreateConstGEP1_64(c.b.getInt8Ty(), buffer, offset));
}

static Value* dimension_pointer(FunctionContext& c, Value* buffer, Value* dimension,
                                int64_t offset) {
  Value* dims = buffer_field(c, buffer, c.b.getPtrTy(), offsetof(halide_buffer_t, dim));
  Value* index = c.b.CreateIntCast(dimension, c.b.getInt64Ty(), true);
  Value* bytes =
      c.b.CreateAdd(c.b.CreateMul(index, c.int64(sizeof(halide_dimension_t))), c.int64(offset));
  return c.b.CreateGEP(c.b.getInt8Ty(), dims, bytes);
}

// Null for a null buffer. This takes no branch: for a null buffer it loads from a constant that holds null.
Value* host_pointer(FunctionContext& c, Value* buffer) {
  auto* type = c.b.getPtrTy();
  auto* zero = c.e.module.getGlobalVariable("no_host", true);
  if (!zero) {
    zero = new llvm::GlobalVariable(c.e.module, type, true, llvm::GlobalValue::PrivateLinkage,
                                    c.null_pointer(), "no_host");
  }
  Value* field = c.b.CreateConstGEP1_64(c.b.getInt8Ty(), buffer, offsetof(halide_buffer_t, host));
  return load_field(
      c, type, c.b.CreateSelect(c.b.CreateICmpEQ(buffer, c.null_pointer()), zero, field), "host");
}

Value* buffer_operator(Values& values, const Call& e) {
  FunctionContext& c = values.c;
  Value* buffer = values.of(e.args[0]);
  const auto dimension_field = [&](int64_t offset) {
    Value* pointer = dimension_pointer(c, buffer, values.of(e.args[1]), offset);
    return convert(c.e, e.type, Int(32), load_field(c, c.b.getInt32Ty(), pointer));
  };
  const auto int_field = [&](uint64_t offset) {
    return convert(c.e, e.type, UInt(32), buffer_field(c, buffer, c.b.getInt32Ty(), offset));
  };
  switch (e.op) {
    case Op::buffer_host:
      return host_pointer(c, buffer);
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
      return c.b.CreateICmpEQ(buffer, c.null_pointer());
    case Op::buffer_is_query: {
      Value* device = buffer_field(c, buffer, c.b.getInt64Ty(), offsetof(halide_buffer_t, device));
      return c.b.CreateAnd(c.b.CreateICmpEQ(host_pointer(c, buffer), c.null_pointer()),
                           c.b.CreateICmpEQ(device, c.b.getInt64(0)));
    }
    default:
      internal_error("no such buffer operator");
  }
}

}  // namespace retrograde::codegen
