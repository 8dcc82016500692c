// Compiles pipelines to libraries without running them. ahead_of_time_use.cpp calls the libraries.
#include "Halide.h"

#include <cstdio>
#include <string>

using namespace Halide;

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  Var x("x"), y("y");

  // The arguments of the function, in the order of the list below: an image and two scalars.
  ImageParam input(UInt(8), 2, "input");
  Param<uint8_t> offset("offset");
  Param<float> strength("strength");

  Func clamped = BoundaryConditions::repeat_edge(input);
  Func sharp("sharp");
  Expr around =
      (clamped(x - 1, y) + cast<int>(clamped(x + 1, y)) + clamped(x, y - 1) + clamped(x, y + 1)) /
      4;
  Expr center = cast<int>(clamped(x, y));
  sharp(x, y) = cast<uint8_t>(
      clamp(center + cast<int>(strength * cast<float>(center - around)) + offset, 0, 255));
  sharp.vectorize(x, 16).parallel(y);

  sharp.compile_to_static_library(folder + "/sharpen", {input, offset, strength}, "sharpen");
  printf("sharpen takes an image and two scalars, and gives an image\n");

  // Several outputs become several buffer arguments after the inputs.
  Func low("low"), high("high");
  low(x, y) = min(input(x, y), offset);
  high(x, y) = max(input(x, y), offset);
  Pipeline both({low, high});
  both.compile_to_static_library(folder + "/split_range", {input, offset}, "split_range");

  // An object, a header, assembly, bitcode, and the lowered statement of the same pipeline.
  sharp.compile_to_object(folder + "/sharpen_only.o", {input, offset, strength}, "sharpen_only",
                          get_target_from_environment().with_feature(Target::NoRuntime));
  sharp.compile_to_header(folder + "/sharpen_only.h", {input, offset, strength}, "sharpen_only");
  sharp.compile_to_assembly(folder + "/sharpen_only.s", {input, offset, strength}, "sharpen_only");
  sharp.compile_to_bitcode(folder + "/sharpen_only.bc", {input, offset, strength}, "sharpen_only");
  for (const char* name :
       {"sharpen.a", "sharpen.h", "split_range.a", "split_range.h", "sharpen_only.o",
        "sharpen_only.h", "sharpen_only.s", "sharpen_only.bc"}) {
    FILE* file = fopen((folder + "/" + name).c_str(), "rb");
    printf("%s: %s\n", name, file ? "written" : "missing");
    if (file) fclose(file);
  }
  return 0;
}
