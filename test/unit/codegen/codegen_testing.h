// Helpers for tests of the code generator: a function that stores expressions over its input
// buffers, called through the JIT on plain arrays.
#pragma once

#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "ir/build.h"
#include "ir/scalar.h"
#include "jit/jit.h"
#include "retrograde_runtime.h"
#include "support/guarded_array.h"

namespace retrograde::testing_codegen {

using namespace ir;

inline LoweredArgument input(const std::string& name, Type type) {
  return {name, LoweredArgument::Kind::InputBuffer, type, 1, {}};
}
inline LoweredArgument output(const std::string& name, Type type) {
  return {name, LoweredArgument::Kind::OutputBuffer, type, 1, {}};
}
inline LoweredArgument scalar_argument(const std::string& name, Type type) {
  return {name, LoweredArgument::Kind::Scalar, type, 0, {}};
}

inline Target test_target() { return get_host_target(); }

inline std::shared_ptr<const jit::CompiledFunction> compile_test(
    const LoweredFunction& function, const Target& target = test_target()) {
  return jit::compile(function, target);
}

// Calls a function whose arguments are all buffers; returns the error code.
inline int call(const LoweredFunction& function, std::vector<Array*> arrays,
                retrograde_context* context = nullptr, const Target& target = test_target()) {
  std::vector<void*> args;
  for (Array* array : arrays) args.push_back(array->raw());
  return compile_test(function, target)->call(context, args.data());
}

inline Expr lanes_at(Expr base, int lanes) {
  return lanes == 1 ? base : make_ramp(std::move(base), make_const(Int(32), 1), lanes);
}

// Random scalars of any type: mostly small, sometimes extreme.
class RandomScalars {
 public:
  explicit RandomScalars(uint32_t seed) : engine_(seed) {}
  Scalar operator()(Type type) {
    if (type.is_float()) return Scalar::of_float(type, number(type));
    return Scalar::of_uint(type, bits(type));
  }

 private:
  uint64_t bits(Type type) {
    switch (engine_() % 8) {
      case 0:
        return static_cast<uint64_t>(type.is_int() ? type.min_int() : 0);
      case 1:
        return type.is_int() ? static_cast<uint64_t>(type.max_int()) : type.max_uint();
      case 2:
        return 0;
      case 3:
        return ~uint64_t{0};
      case 4:
        return engine_() % 16;
      case 5:
        return static_cast<uint64_t>(-static_cast<int64_t>(engine_() % 16));
      default:
        return engine_();
    }
  }
  double number(Type type) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double special[] = {0.0,          -0.0, 1.0,   -1.0, infinity, -infinity,
                              std::nan(""), 0.5,  1e-40, 6e-8, 65504,    3e38};
    if (engine_() % 4 == 0) return special[engine_() % std::size(special)];
    const double scale = type.bits() == 16 ? 100 : 1e4;
    return scale * std::uniform_real_distribution<double>(-1, 1)(engine_);
  }
  std::mt19937_64 engine_;
};

// Bitwise equality; all NaNs are equal.
inline bool same(const Scalar& a, const Scalar& b) {
  if (!a.type.is_float()) return a.u == b.u;
  if (std::isnan(a.f) || std::isnan(b.f)) return std::isnan(a.f) && std::isnan(b.f);
  return std::bit_cast<uint64_t>(a.f) == std::bit_cast<uint64_t>(b.f);
}

inline std::string show(const Scalar& s) {
  if (s.type.is_float()) return to_string(s.type) + " " + std::to_string(s.f);
  return to_string(s.type) + " " + (s.type.is_int() ? std::to_string(s.i) : std::to_string(s.u));
}

}  // namespace retrograde::testing_codegen
