// Images: created in memory, read from and written to files, brightened with a Param.
#include "Halide.h"
#include "halide_image_io.h"

#include <cstdio>
#include <string>

using Halide::Buffer;
using Halide::Expr;
using Halide::Func;
using Halide::ImageParam;
using Halide::Param;
using Halide::Var;

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";

  // Planar in memory: all of one channel, then all of the next.
  Buffer<uint8_t> drawn(48, 32, 3);
  drawn.for_each_element(
      [&](int x, int y, int c) { drawn(x, y, c) = (uint8_t)(x * 4 + y * 3 * (c + 1)); });
  Halide::Tools::save_image(drawn, folder + "/drawn.ppm");

  // The file contains the same pixels.
  Buffer<uint8_t> loaded = Halide::Tools::load_image(folder + "/drawn.ppm");
  int differences = 0;
  loaded.for_each_element([&](int x, int y, int c) {
    if (loaded(x, y, c) != drawn(x, y, c)) differences++;
  });
  printf("loaded %d x %d x %d, %d differences\n", loaded.width(), loaded.height(),
         loaded.channels(), differences);

  // A pipeline for any image and any gain.
  ImageParam input(Halide::type_of<uint8_t>(), 3, "input");
  Param<float> gain("gain");
  Func brighter("brighter");
  Var x("x"), y("y"), c("c");
  Expr value = Halide::cast<float>(input(x, y, c)) * gain;
  brighter(x, y, c) = Halide::cast<uint8_t>(min(value, 255.0f));

  input.set(loaded);
  for (float g : {0.5f, 1.0f, 1.75f}) {
    gain.set(g);
    Buffer<uint8_t> result = brighter.realize({loaded.width(), loaded.height(), loaded.channels()});
    long sum = 0;
    result.for_each_value([&](uint8_t v) { sum += v; });
    printf("gain %.2f: sum %ld, pixel (40, 20) is %d %d %d\n", g, sum, result(40, 20, 0),
           result(40, 20, 1), result(40, 20, 2));
    if (g > 1.5f) Halide::Tools::save_image(result, folder + "/brighter.ppm");
  }

  // Interleaved images have their channels innermost in memory.
  Buffer<uint8_t> interleaved = Buffer<uint8_t>::make_interleaved(16, 8, 3);
  interleaved.fill(7);
  printf("strides %d %d %d, and planar %d %d %d\n", interleaved.dim(0).stride(),
         interleaved.dim(1).stride(), interleaved.dim(2).stride(), drawn.dim(0).stride(),
         drawn.dim(1).stride(), drawn.dim(2).stride());

  // A window into an image shares its memory.
  Buffer<uint8_t> window(drawn.get()->cropped(0, 8, 10).cropped(1, 4, 6));
  window.fill(255);
  printf("window starts at (%d, %d), drawn(8, 4) is %d, drawn(7, 4) is %d\n", window.min(0),
         window.min(1), drawn(8, 4, 0), drawn(7, 4, 0));
  return 0;
}
