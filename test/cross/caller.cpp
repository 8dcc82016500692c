// Calls functions that were compiled for another processor. Built by that processor's cross
// compiler, run by an emulator; returns 0 when everything is right.
#include <HalideBuffer.h>
#include <HalideRuntime.h>

#include <cstdio>
#include <cstring>
#include <string>

#include <cmath>

#include "aot_blur_alone.h"
#include "aot_math.h"
#include "aot_scalars.h"
#include "aot_table.h"
#include "aot_tuple.h"

using Halide::Runtime::Buffer;

static int failures = 0;

static void expect(bool holds, const char* what) {
  if (holds) return;
  std::printf("not so: %s\n", what);
  failures++;
}

static std::string last_error;

static void test_blur() {
  Buffer<uint8_t, 2> in(66, 34);
  Buffer<uint16_t, 2> out(64, 32);
  in.for_each_element([&](int x, int y) { in(x, y) = static_cast<uint8_t>(7 * x + 13 * y); });
  expect(aot_blur_alone(in, 5, out) == 0, "a stencil runs on several threads");
  bool is_right = true;
  out.for_each_element([&](int x, int y) {
    int sum = 0;
    for (int i = 0; i < 9; i++) sum += in(x + i % 3, y + i / 3);
    is_right = is_right && out(x, y) == sum / 9 + 5;
  });
  expect(is_right, "its result is right");
  Buffer<uint8_t, 2> query(nullptr, 0, 0);
  expect(aot_blur_alone(query, 5, out) == 0 && query.dim(0).extent() == 66,
         "a bounds query answers");
  halide_set_error_handler([](void*, const char* message) { last_error = message; });
  Buffer<uint8_t, 2> small(65, 34);
  expect(aot_blur_alone(small, 5, out) == halide_error_code_access_out_of_bounds &&
             last_error.find("\"in\" is read") != std::string::npos,
         "a small buffer is an error");
  halide_set_custom_malloc([](void*, size_t) -> void* { return nullptr; });
  expect(aot_blur_alone(in, 5, out) == halide_error_code_out_of_memory,
         "a failing allocation is an error");
  halide_set_custom_malloc(nullptr);
  expect(std::strncmp(aot_blur_alone_metadata()->target, "arm-64-linux", 12) == 0,
         "metadata names the target");
}

static void test_arguments() {
  Buffer<double, 1> out(11);
  expect(aot_scalars(true, -100, 200, -30000, 60000, -2000000000, 4000000000u, -(1LL << 60),
                     uint64_t{1} << 63, 1.5f, -2.25, nullptr, out) == 0,
         "scalars of every type arrive");
  const double wanted[] = {1, -100, 200, -30000, 60000, -2e9, 4e9, -0x1p60, 0x1p63, 1.5, -2.25};
  for (int i = 0; i < 11; i++) expect(out(i) == wanted[i], "a scalar has its value");
  Buffer<float, 1> in(8), first(8);
  Buffer<int32_t, 1> second(8);
  in.fill(1.5f);
  expect(aot_tuple(in, first, second) == 0 && first(7) == 2.5f && second(7) == 3, "tuples");
  Buffer<float, 2> table(4, 3);
  table.set_min(-1, 2);
  expect(aot_table(table) == 0 && table(2, 4) == 46.0f, "embedded tables");
}

static void test_math() {
  Buffer<float, 1> in(13), out(13);
  for (int i = 0; i < 13; i++) in(i) = 0.25f * static_cast<float>(i);
  expect(aot_math(in, out) == 0, "vector math links and runs");
  for (int i = 0; i < 13; i++) {
    const double x = in(i), wanted = std::sin(x) + std::exp(x) * std::pow(x, 1.5);
    expect(std::fabs(out(i) - wanted) <= 1e-6 * std::fabs(wanted), "vector math is right");
  }
}

int main() {
  test_math();
  test_blur();
  test_arguments();
  std::printf("%d failures\n", failures);
  return failures;
}
