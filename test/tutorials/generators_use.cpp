// Calls the functions compiled by generators.cpp: one generator with two sets of params, and a
// second generator.
#include "blend.h"
#include "mean_3x3.h"
#include "mean_5x5_zero.h"

#include "HalideBuffer.h"

#include <cstdio>

using Halide::Runtime::Buffer;

int main() {
  Buffer<uint8_t> input(64, 48), three(64, 48), five(64, 48);
  input.for_each_element([&](int x, int y) { input(x, y) = (uint8_t)((x * 9 + y * 7) % 200); });
  int code = mean_3x3(input, 10, three);
  printf("3 x 3 returned %d: %d %d %d\n", code, three(0, 0), three(30, 20), three(63, 47));
  code = mean_5x5_zero(input, -5, five);
  printf("5 x 5 returned %d: %d %d %d\n", code, five(0, 0), five(30, 20), five(63, 47));

  Buffer<float> a(10), b(10), c(10), sum(10);
  Buffer<int> count(10);
  auto largest = Buffer<float>::make_scalar();
  for (int i = 0; i < 10; i++) {
    a(i) = (float)(i * i % 7);
    b(i) = (float)i;
    c(i) = 100.0f * i;
  }
  code = blend(a, b, 0.25f, c, sum, count, largest);
  printf("blend returned %d: %g %g, %d images, largest %g\n", code, sum(3), sum(9), count(0),
         largest());

  const halide_filter_metadata_t* metadata = blend_metadata();
  for (int i = 0; i < metadata->num_arguments; i++) printf(" %s", metadata->arguments[i].name);
  printf("\n");
  return 0;
}
