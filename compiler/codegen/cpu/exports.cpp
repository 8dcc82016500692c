#include "codegen/cpu/exports.h"

#include <HalideRuntime.h>

#include "codegen/cpu/make_exports.h"
#include "codegen/emitter.h"
#include "diagnostics/error.h"
#include "retrograde_runtime.h"

namespace retrograde::codegen {
namespace {

using namespace ir;

// Size of the context on the caller's stack. It is larger than today's context so that a later runtime's fits.
constexpr uint64_t context_bytes = 256;
static_assert(sizeof(retrograde_context) <= context_bytes);

uint64_t bits_of(const Scalar& value) {
  return value.type.is_float() ? eval_reinterpret(UInt(value.type.bits()), value).u : value.u;
}

class Exporter {
 public:
  explicit Exporter(Emitter& emitter) : e_(emitter), b_(emitter.b) {}

  void add(const Export& e, llvm::Function* body) {
    body->setLinkage(llvm::GlobalValue::InternalLinkage);
    llvm::Function* function = begin(e.signature);
    Value* context = b_.CreateAlloca(b_.getInt8Ty(), b_.getInt64(context_bytes));
    llvm::cast<llvm::AllocaInst>(context)->setAlignment(llvm::Align(16));
    Value* user_context = e.signature.user_context ? static_cast<Value*>(function->getArg(0))
                                                   : llvm::ConstantPointerNull::get(b_.getPtrTy());
    const auto begin_call = e_.module.getOrInsertFunction("retrograde_begin_call", b_.getVoidTy(),
                                                          b_.getPtrTy(), b_.getPtrTy());
    b_.CreateCall(begin_call, {context, user_context});
    std::vector<Value*> args = {context};
    for (const Source& source : e.sources)
      args.push_back(source.embedded ? embed(*source.embedded)
                                     : argument(e.signature, function, source.argument));
    b_.CreateRet(b_.CreateCall(body, args));
    add_companions(e.signature, function);
  }

  void add(const Dispatch& dispatch) {
    llvm::Function* function = begin(dispatch.signature);
    for (const Dispatch::Variant& variant : dispatch.variants) {
      if (&variant == &dispatch.variants.back()) {
        call_variant(variant, function);
        break;
      }
      auto* chosen = llvm::BasicBlock::Create(e_.context(), "chosen", function);
      auto* next = llvm::BasicBlock::Create(e_.context(), "next", function);
      b_.CreateCondBr(can_use(variant), chosen, next);
      b_.SetInsertPoint(chosen);
      call_variant(variant, function);
      b_.SetInsertPoint(next);
    }
    add_companions(dispatch.signature, function);
  }

 private:
  Emitter& e_;
  llvm::IRBuilder<>& b_;

  // The C ABI's type: bool is a byte, 16-bit floats are their bits.
  llvm::Type* parameter_type(const ExportArgument& argument) {
    if (argument.is_buffer() || argument.type.is_handle()) return b_.getPtrTy();
    return memory_type(e_, argument.type);
  }

  llvm::FunctionType* function_type(const Signature& signature) {
    std::vector<llvm::Type*> params;
    for (const ExportArgument& a : signature.arguments) params.push_back(parameter_type(a));
    return llvm::FunctionType::get(b_.getInt32Ty(), params, false);
  }

  // The caller extends small integers if the platform's ABI requires it.
  void mark_extensions(const Signature& signature, llvm::Function* function) {
    for (unsigned i = 0; i < signature.arguments.size(); i++) {
      const ExportArgument& a = signature.arguments[i];
      if (a.is_buffer() || !parameter_type(a)->isIntegerTy() || a.type.bits() >= 32) continue;
      function->addParamAttr(i, a.type.is_int() ? llvm::Attribute::SExt : llvm::Attribute::ZExt);
    }
  }

  llvm::Function* declare(const Signature& signature, const std::string& name) {
    auto* function = llvm::Function::Create(function_type(signature),
                                            llvm::GlobalValue::ExternalLinkage, name, e_.module);
    mark_extensions(signature, function);
    return function;
  }

  llvm::Function* set_up(llvm::Function* function) {
    set_target(e_, function);
    b_.SetInsertPoint(llvm::BasicBlock::Create(e_.context(), "entry", function));
    return function;
  }

  llvm::Function* begin(const Signature& signature) {
    return set_up(declare(signature, signature.name));
  }

  Value* argument(const Signature& signature, llvm::Function* function, int index) {
    Value* value = function->getArg(static_cast<unsigned>(index));
    const ExportArgument& a = signature.arguments[static_cast<size_t>(index)];
    if (a.is_buffer() || !a.type.is_bool()) return value;
    return b_.CreateICmpNE(value, llvm::ConstantInt::get(value->getType(), 0));
  }

  void call_variant(const Dispatch::Variant& variant, llvm::Function* wrapper) {
    auto* target = llvm::Function::Create(
        wrapper->getFunctionType(), llvm::GlobalValue::ExternalLinkage, variant.name, e_.module);
    target->setAttributes(wrapper->getAttributes());
    std::vector<Value*> args;
    for (llvm::Argument& a : wrapper->args()) args.push_back(&a);
    llvm::CallInst* call = b_.CreateCall(target, args);
    call->setAttributes(target->getAttributes());
    b_.CreateRet(call);
  }

  Value* can_use(const Dispatch::Variant& variant) {
    auto* words = llvm::ConstantDataArray::get(e_.context(), variant.features);
    const auto ask = e_.module.getOrInsertFunction("halide_can_use_target_features",
                                                   b_.getInt32Ty(), b_.getInt32Ty(), b_.getPtrTy());
    Value* answer = b_.CreateCall(
        ask, {b_.getInt32(static_cast<uint32_t>(variant.features.size())), constant(words)});
    return b_.CreateICmpNE(answer, b_.getInt32(0));
  }

  // ---- name_argv and name_metadata ----

  void add_companions(const Signature& signature, llvm::Function* function) {
    if (!signature.argv_name.empty()) add_argv(signature, function);
    if (!signature.metadata_name.empty()) add_metadata(signature);
  }

  void add_argv(const Signature& signature, llvm::Function* function) {
    auto* type = llvm::FunctionType::get(b_.getInt32Ty(), {b_.getPtrTy()}, false);
    llvm::Function* argv = set_up(llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage,
                                                         signature.argv_name, e_.module));
    std::vector<Value*> args;
    for (size_t i = 0; i < signature.arguments.size(); i++) {
      Value* entry =
          b_.CreateLoad(b_.getPtrTy(), b_.CreateConstGEP1_64(b_.getPtrTy(), argv->getArg(0), i));
      const ExportArgument& a = signature.arguments[i];
      args.push_back(a.is_buffer() ? entry : b_.CreateLoad(parameter_type(a), entry));
    }
    llvm::CallInst* call = b_.CreateCall(function, args);
    call->setAttributes(function->getAttributes());
    b_.CreateRet(call);
  }

  void add_metadata(const Signature& signature) {
    auto* type = llvm::FunctionType::get(b_.getPtrTy(), {}, false);
    set_up(llvm::Function::Create(type, llvm::GlobalValue::ExternalLinkage, signature.metadata_name,
                                  e_.module));
    b_.CreateRet(metadata(signature));
  }

  llvm::Constant* metadata(const Signature& signature) {
    static_assert(sizeof(halide_filter_metadata_t) == 32 && sizeof(halide_filter_argument_t) == 64);
    std::vector<llvm::Constant*> arguments;
    for (const ExportArgument& a : signature.arguments) arguments.push_back(argument_metadata(a));
    auto* array = llvm::ConstantArray::get(
        llvm::ArrayType::get(arguments[0]->getType(), arguments.size()), arguments);
    return constant(
        structure({b_.getInt32(1), b_.getInt32(static_cast<uint32_t>(arguments.size())),
                   constant(array), string(signature.target), string(signature.metadata_title)}));
  }

  llvm::Constant* argument_metadata(const ExportArgument& a) {
    return structure({string(a.name), b_.getInt32(static_cast<uint32_t>(a.kind)),
                      b_.getInt32(static_cast<uint32_t>(a.dimensions)),
                      b_.getInt32(type_word(a.type)), scalar(a.def), scalar(a.min), scalar(a.max),
                      scalar(a.estimate), buffer_estimates(a)});
  }

  llvm::Constant* scalar(const std::optional<Scalar>& value) {
    return value ? constant(b_.getInt64(bits_of(*value))) : null();
  }

  // An array of pointers to the min and extent of each dimension.
  llvm::Constant* buffer_estimates(const ExportArgument& a) {
    if (!a.is_buffer() || a.buffer_estimates.empty()) return null();
    std::vector<llvm::Constant*> pointers;
    for (const auto& [min, extent] : a.buffer_estimates) {
      pointers.push_back(constant(b_.getInt64(static_cast<uint64_t>(min))));
      pointers.push_back(constant(b_.getInt64(static_cast<uint64_t>(extent))));
    }
    return constant(
        llvm::ConstantArray::get(llvm::ArrayType::get(b_.getPtrTy(), pointers.size()), pointers));
  }

  // ---- embedded buffers ----

  llvm::Constant* embed(const halide_buffer_t& buffer) {
    static_assert(sizeof(halide_buffer_t) == 56);
    RETROGRADE_ASSERT(buffer.host != nullptr, "an embedded buffer has no data");
    auto* data = constant(llvm::ConstantDataArray::getString(
        e_.context(),
        llvm::StringRef(reinterpret_cast<const char*>(buffer.begin()), buffer.size_in_bytes()),
        false));
    data->setAlignment(llvm::Align(retrograde_allocation_alignment));
    const int64_t first = -buffer.begin_offset() * buffer.type.bytes();
    llvm::Constant* host = llvm::ConstantExpr::getGetElementPtr(
        b_.getInt8Ty(), data, llvm::ArrayRef<llvm::Constant*>{b_.getInt64(first)});
    auto* result = constant(structure(
        {b_.getInt64(0), null(), host, b_.getInt64(0), b_.getInt32(buffer.type.as_u32()),
         b_.getInt32(static_cast<uint32_t>(buffer.dimensions)), dimensions(buffer), null()}));
    result->setConstant(false);
    return result;
  }

  llvm::Constant* dimensions(const halide_buffer_t& buffer) {
    std::vector<uint32_t> words;
    for (int d = 0; d < buffer.dimensions; d++) {
      const halide_dimension_t& dim = buffer.dim[d];
      for (int32_t word : {dim.min, dim.extent, dim.stride, 0})
        words.push_back(static_cast<uint32_t>(word));
    }
    if (words.empty()) return null();
    return constant(llvm::ConstantDataArray::get(e_.context(), words));
  }

  // ---- constants in memory ----

  llvm::GlobalVariable* constant(llvm::Constant* value) {
    return new llvm::GlobalVariable(e_.module, value->getType(), true,
                                    llvm::GlobalValue::PrivateLinkage, value);
  }
  llvm::Constant* string(const std::string& text) {
    return constant(llvm::ConstantDataArray::getString(e_.context(), text));
  }
  llvm::Constant* structure(const std::vector<llvm::Constant*>& fields) {
    return llvm::ConstantStruct::getAnon(e_.context(), fields);
  }
  llvm::Constant* null() { return llvm::ConstantPointerNull::get(b_.getPtrTy()); }
};

}  // namespace

void make_export(Emitter& emitter, const Export& e, llvm::Function* body) {
  Exporter(emitter).add(e, body);
}
void make_dispatch(Emitter& emitter, const Dispatch& dispatch) { Exporter(emitter).add(dispatch); }

}  // namespace retrograde::codegen
