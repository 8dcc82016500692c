// Cross-compilation: machine code for other targets.
#include "Halide.h"

#include <cstdio>
#include <string>

using namespace Halide;

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  Var x("x"), y("y");
  ImageParam depth(UInt(16), 2, "depth");
  Param<uint16_t> nearest("nearest"), farthest("farthest");
  Func mask("mask");
  Expr is_seen = depth(x, y) >= nearest && depth(x, y) <= farthest;
  mask(x, y) = select(is_seen, cast<uint8_t>(255), cast<uint8_t>(depth(x, y) >> 9));
  mask.parallel(y, 8).vectorize(x, 32);
  const std::vector<Argument> args = {depth, nearest, farthest};

  for (const char* name : {"x86-64-linux-sse41", "x86-64-linux-avx-avx2-fma", "arm-64-linux",
                           "x86-64-linux-no_asserts-no_bounds_query"}) {
    Target target(name);
    const std::string file = folder + "/mask_for_" + name;
    mask.compile_to_file(file, args, "mask_between", target);

    // Bytes 18 and 19 of an ELF file name its machine.
    unsigned char header[32] = {};
    FILE* object = fopen((file + ".o").c_str(), "rb");
    size_t size = object ? fread(header, 1, sizeof header, object) : 0;
    if (object) fclose(object);
    printf("%-42s %zu bytes read, '%c%c%c', %d bits, machine %d, text \"%s\"\n", name, size,
           header[1], header[2], header[3], header[4] * 32, header[18] + 256 * header[19],
           target.to_string().c_str());
  }

  // Targets are values whose features can be queried and set.
  Target t;
  t.os = Target::Linux;
  t.arch = Target::ARM;
  t.bits = 64;
  t.set_feature(Target::NoAsserts);
  printf("%s: %d %d %d\n", t.to_string().c_str(), (int)t.has_feature(Target::NoAsserts),
         (int)t.has_feature(Target::AVX2), (int)t.has_gpu_feature());
  printf("lanes of float: %d and %d\n", Target("arm-64-linux").natural_vector_size<float>(),
         Target("x86-64-linux-avx-avx2").natural_vector_size<float>());
  printf("valid: %d %d\n", (int)Target::validate_target_string("x86-64-linux-avx2"),
         (int)Target::validate_target_string("x86-64-linux-avx9"));
  return 0;
}
