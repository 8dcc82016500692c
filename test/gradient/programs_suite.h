// The gradient suite: small programs by name. A file of programs is a list of PROGRAM(name) { ... } and
// PROGRAM_OF(name, image) { ... }; the driver (programs_suite_test.cpp) checks each one.
#pragma once

#include <string>
#include <vector>

#include "gradient/gradient_check.h"

namespace retrograde::gradient {

struct Program {
  Func loss;  // a scalar
  std::vector<Buffer<float>> inputs;
  bool store_overwritten = false;  // under Overwritten::Refuse a UserError
};

struct NamedProgram {
  const char* name;
  Program (*build)();
};
// A loop of n steps.
struct NamedLoop {
  const char* name;
  Program (*build)(int n);
};

inline std::vector<NamedProgram>& programs() {
  static std::vector<NamedProgram> all;
  return all;
}
struct RegisteredProgram {
  RegisteredProgram(const char* name, Program (*build)()) { programs().push_back({name, build}); }
};

#define PROGRAM(name)                                            \
  static Program name();                                         \
  static const RegisteredProgram registered_##name(#name, name); \
  static Program name()
// Most programs have one image, `a`, and build on a Func `f`.
#define PROGRAM_OF(name, ...)                                                                    \
  static Program name(const Buffer<float>& a, Func f);                                           \
  static const RegisteredProgram registered_##name(#name,                                        \
                                                   [] { return name(__VA_ARGS__, Func("f")); }); \
  static Program name(const Buffer<float>& a, Func f)

// Inputs that most programs use: values between 0.25 and 2.
inline Buffer<float> line(int n = 9, unsigned seed = 1) { return random_image({n}, 0.25, 2, seed); }
inline Buffer<float> plane(int w = 7, int h = 6, unsigned seed = 2) {
  return random_image({w, h}, 0.25, 2, seed);
}
// Integers 0, 1, ..., bound - 1, scrambled: data-dependent indices.
inline Buffer<int> places(int n, int bound, unsigned seed = 3) {
  Buffer<int> result(n);
  std::mt19937 random(seed);
  result.get()->for_each_value(
      [&](int& v) { v = static_cast<int>(random() % static_cast<unsigned>(bound)); });
  return result;
}

// The peak memory in bytes, as the profiler reports it.
inline int64_t peak_memory(const Derivative& d, const Buffer<float>& input) {
  Func gradient = d(input);
  std::string report;
  gradient.jit_handlers().print = [&](const char* text) { report += text; };
  gradient.realize({input.width()},
                   get_jit_target_from_environment().with_feature(Target::Profile));
  size_t at = report.find("peak memory: ");
  EXPECT_NE(at, std::string::npos) << report;
  return at == std::string::npos ? 0 : std::stoll(report.substr(at + 13));
}

}  // namespace retrograde::gradient
