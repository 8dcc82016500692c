// Calls the libraries of ahead_of_time.cpp. The program contains no compiler; it includes the
// generated header and the header of buffers.
#include "sharpen.h"
#include "split_range.h"

#include "HalideBuffer.h"

#include <cstdio>

using Halide::Runtime::Buffer;

static int errors;
static char last_error[400];
static void remember(void*, const char* message) {
  errors++;
  snprintf(last_error, sizeof last_error, "%s", message);
}

int main() {
  Buffer<uint8_t> input(200, 100), output(200, 100);
  input.for_each_element([&](int x, int y) { input(x, y) = (uint8_t)((x * 5 + y * y) % 251); });

  int code = sharpen(input, 3, 0.75f, output);
  long sum = 0;
  output.for_each_value([&](uint8_t v) { sum += v; });
  printf("sharpen returned %d: %d %d %d, sum %ld\n", code, output(0, 0), output(100, 50),
         output(199, 99), sum);

  // Any region of the output, at any coordinates.
  Buffer<uint8_t> corner(16, 8);
  corner.set_min(180, 90);
  code = sharpen(input, 3, 0.75f, corner);
  printf("a corner returned %d: %d, as before %d\n", code, corner(195, 97), output(195, 97));

  Buffer<uint8_t> low(200, 100), high(200, 100);
  code = split_range(input, 100, low, high);
  printf("split_range returned %d: %d %d, %d %d\n", code, low(3, 4), high(3, 4), low(60, 9),
         high(60, 9));

  // The same call through an array of pointers.
  uint8_t offset = 3;
  float strength = 0.75f;
  Buffer<uint8_t> again(200, 100);
  void* args[] = {input.raw_buffer(), &offset, &strength, again.raw_buffer()};
  code = sharpen_argv(args);
  int differences = 0;
  again.for_each_element([&](int x, int y) { differences += again(x, y) != output(x, y); });
  printf("sharpen_argv returned %d: %d differences\n", code, differences);

  // Metadata describes the arguments.
  const halide_filter_metadata_t* metadata = sharpen_metadata();
  printf("%s:", metadata->name);
  for (int i = 0; i < metadata->num_arguments; i++) {
    const halide_filter_argument_t& argument = metadata->arguments[i];
    printf(" %s (kind %d, %d dimensions, type %d:%d)", argument.name, argument.kind,
           argument.dimensions, argument.type.code, argument.type.bits);
  }
  printf("\n");

  // A buffer that is too small is an error, with a code and a message.
  halide_set_error_handler(remember);
  Buffer<uint8_t> tiny(10, 10);
  code = split_range(tiny, 100, low, high);
  printf("too small: code %d, %d error, message %s\n", code, errors,
         last_error[0] ? "given" : "missing");

  // A buffer without memory is a bounds query: the call returns the required regions.
  Buffer<uint8_t> query(nullptr, 0, 0);
  code = split_range(query, 100, low, high);
  printf("query returned %d: %d x %d\n", code, query.width(), query.height());
  return 0;
}
