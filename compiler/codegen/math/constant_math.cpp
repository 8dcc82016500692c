// Evaluates vector math of constants at compile time. Unrolled loops contain much of it, for example twiddle factors
// and window functions. The result comes from the scalar function of the family that the generated code would call,
// whose bits do not depend on the vector width (math_table.h). If the generated code calls the C library of another
// machine, nothing is evaluated.
#include "codegen/math/constant_math.h"

#include <llvm/ADT/APFloat.h>
#include <llvm/IR/Constants.h>

#include "codegen/math/sleef_library.h"

namespace retrograde::codegen {
namespace {

// Whether this processor can run the functions that the target would call: those of the FMA family need FMA.
bool runs_here(const Machine& machine) {
#if defined(__x86_64__)
  return !machine.has_fma() || (__builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2"));
#else
  return machine.has_fma();
#endif
}

void* find_function(const Machine& machine, const MathFunction& function, int bits) {
  if (!machine.has_sleef || !runs_here(machine)) return nullptr;
  return find_in_sleef(machine.math_symbol(function.stem, function.precision, bits, 1).c_str());
}

// One lane of each argument; empty if an argument's lane is not a number.
template <class T>
std::vector<T> numbers(const std::vector<Value*>& args, unsigned lane) {
  std::vector<T> result;
  for (Value* arg : args) {
    auto* constant = llvm::dyn_cast<llvm::Constant>(arg);
    if (constant && constant->getType()->isVectorTy())
      constant = constant->getAggregateElement(lane);
    const auto* number = llvm::dyn_cast_or_null<llvm::ConstantFP>(constant);
    if (!number) return {};
    const llvm::APFloat& value = number->getValueAPF();
    result.push_back(sizeof(T) == 4 ? static_cast<T>(value.convertToFloat())
                                    : static_cast<T>(value.convertToDouble()));
  }
  return result;
}

template <class T>
Value* compute(void* function, const std::vector<Value*>& args) {
  llvm::Type* scalar = args[0]->getType()->getScalarType();
  std::vector<llvm::Constant*> lanes;
  for (int lane = 0; lane < lanes_of(args[0]); lane++) {
    const std::vector<T> x = numbers<T>(args, static_cast<unsigned>(lane));
    if (x.empty() || x.size() > 2) return nullptr;
    const T result = x.size() == 1 ? reinterpret_cast<T (*)(T)>(function)(x[0])
                                   : reinterpret_cast<T (*)(T, T)>(function)(x[0], x[1]);
    lanes.push_back(llvm::ConstantFP::get(scalar->getContext(), llvm::APFloat(result)));
  }
  return args[0]->getType()->isVectorTy() ? llvm::ConstantVector::get(lanes) : lanes[0];
}

}  // namespace

Value* constant_result(Emitter& e, const MathFunction& function, const std::vector<Value*>& args) {
  for (Value* arg : args) {
    if (!llvm::isa<llvm::Constant>(arg)) return nullptr;
  }
  const bool is_single = args[0]->getType()->getScalarType()->isFloatTy();
  void* found = find_function(e.machine, function, is_single ? 32 : 64);
  if (!found) return nullptr;
  return is_single ? compute<float>(found, args) : compute<double>(found, args);
}

}  // namespace retrograde::codegen
