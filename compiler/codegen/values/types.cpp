// Maps our types to LLVM's, and makes constants of them.
#include "codegen/emitter.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {

void set_target(Emitter& e, llvm::Function* function) {
  function->addFnAttr(llvm::Attribute::NoUnwind);
  function->addFnAttr("target-cpu", e.machine.cpu);
  function->addFnAttr("target-features", e.machine.features);
  if (!e.machine.tune_cpu.empty()) function->addFnAttr("tune-cpu", e.machine.tune_cpu);
  // Vectors are as wide as the schedule says, whatever width the processor prefers.
  const std::string bits = std::to_string(e.machine.vector_bits);
  function->addFnAttr("min-legal-vector-width", bits);
  function->addFnAttr("prefer-vector-width", bits);
}

bool is_half(Type type) { return type.is_float() && type.bits() == 16; }

llvm::Type* with_lanes(llvm::Type* scalar, int lanes) {
  return lanes == 1 ? scalar : llvm::FixedVectorType::get(scalar, static_cast<unsigned>(lanes));
}

static llvm::Type* scalar_type(Emitter& e, Type type) {
  if (type.is_handle()) return e.b.getPtrTy();
  if (!type.is_float() || type.bits() == 16)
    return e.b.getIntNTy(static_cast<unsigned>(type.bits()));
  RETROGRADE_ASSERT(type.bits() == 32 || type.bits() == 64, "no machine type for ",
                    to_string(type));
  return type.bits() == 32 ? e.b.getFloatTy() : e.b.getDoubleTy();
}

llvm::Type* llvm_type(Emitter& e, Type type) {
  return with_lanes(scalar_type(e, type), type.lanes());
}

llvm::Type* memory_type(Emitter& e, Type type) {
  return type.is_bool() ? e.b.getInt8Ty() : scalar_type(e, type);
}

int lanes_of(const Value* value) {
  const auto* vector = llvm::dyn_cast<llvm::FixedVectorType>(value->getType());
  return vector ? static_cast<int>(vector->getNumElements()) : 1;
}

Value* int_constant(Value* like, int64_t value) {
  return llvm::ConstantInt::get(like->getType(), static_cast<uint64_t>(value), true);
}

Value* float_constant(llvm::Type* type, double value) { return llvm::ConstantFP::get(type, value); }
Value* float_constant(Value* like, double value) { return float_constant(like->getType(), value); }

Value* bits_as_float(Emitter& e, Value* integer) {
  const unsigned bits = integer->getType()->getScalarSizeInBits();
  return e.b.CreateBitCast(
      integer, with_lanes(bits == 32 ? e.b.getFloatTy() : e.b.getDoubleTy(), lanes_of(integer)));
}

Value* bits_as_integer(Emitter& e, Value* number) {
  const unsigned bits = number->getType()->getScalarSizeInBits();
  return e.b.CreateBitCast(number, with_lanes(e.b.getIntNTy(bits), lanes_of(number)));
}

Value* from_memory(Emitter& e, Type type, Value* v) {
  return type.is_bool() ? e.b.CreateICmpNE(v, int_constant(v, 0)) : v;
}

Value* to_memory(Emitter& e, Type type, Value* v) {
  return type.is_bool() ? e.b.CreateZExt(v, with_lanes(e.b.getInt8Ty(), lanes_of(v))) : v;
}

}  // namespace retrograde::codegen
