// cases.h -- the test cases of a compiled program: the arguments of its function at several sizes, as a text that the
// programs' builders write and their workers read:
//
//   program NAME TOLERANCE
//   gradients COUNT                                     the number of first inputs that have gradients;
//                                                         the gradients follow a scalar output, the sum
//   case LABEL THREADS                                  threads: 0 means all
//   in   TYPE LAYOUT FILL LOW HIGH MIN:EXTENT...        an array; LAYOUT planar or interleaved,
//   out  TYPE LAYOUT MIN:EXTENT...                        FILL picture or noise
//   value TYPE NUMBER                                   a scalar
//
// Arguments are in the function's order, TYPE is "uint8", "float32" and so on.
#pragma once

#include <filesystem>
#include <string>
#include <type_traits>
#include <vector>

namespace programs {

struct Type {
  int code = 0, bits = 0;  // as in halide_type_t: 0 signed, 1 unsigned, 2 float
};

enum class Role { Input, Output, Scalar };

struct Argument {
  Role role = Role::Input;
  Type type;
  std::vector<int> extents, mins;  // mins: empty, or one for each extent
  bool is_interleaved = false;     // the third dimension is innermost
  bool is_noise = false;           // else a picture
  double low = 0, high = 1;        // range of inputs; a scalar is `low`

  Argument interleaved() const;
  Argument noise() const;
  Argument from(std::vector<int> first) const;
};

struct Case {
  std::string label;
  int threads = 0;
  std::vector<Argument> arguments;
};

struct Program {
  std::string name;
  int gradients = 0;     // number of inputs with gradients; 0: not a gradient
  double tolerance = 0;  // largest relative error; 0: exact for integers, 1e-4 otherwise
  std::vector<Case> cases;
};

void write_cases(const std::filesystem::path& path, const Program& program);
// Throws std::runtime_error.
Program read_cases(const std::filesystem::path& path);

// ---- helpers for programs to write them ----

template <typename T>
constexpr Type type_of() {
  const int code = std::is_floating_point_v<T> ? 2 : std::is_signed_v<T> ? 0 : 1;
  return {code, static_cast<int>(8 * sizeof(T))};
}

// Values from `low` to just below `high`.
template <typename T>
Argument in(std::vector<int> extents, double low = 0, double high = 1) {
  return {Role::Input, type_of<T>(), std::move(extents), {}, false, false, low, high};
}
template <typename T>
Argument out(std::vector<int> extents) {
  return {Role::Output, type_of<T>(), std::move(extents), {}, false, false, 0, 0};
}
template <typename T>
Argument value(T number) {
  return {Role::Scalar, type_of<T>(), {}, {}, false, false, static_cast<double>(number)};
}

}  // namespace programs
