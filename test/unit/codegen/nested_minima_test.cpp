// Nested minima in PTX: see codegen/device/nested_minima.h.
#include "codegen/device/nested_minima.h"

#include <gtest/gtest.h>

namespace retrograde::codegen {
namespace {

// A function that consists of these lines.
std::string function(const std::string& lines) { return ".entry f()\n{\n" + lines + "}\n"; }

size_t count(const std::string& text, const std::string& part) {
  size_t found = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(NestedMinima, EverySecondOfAChainIsUnsigned) {
  const std::string parted = rewrite_nested_minima(
      function("\tneg.s32 \t%r4, %r2;\n\tmin.s32 \t%r5, %r1, %r4;\n\tmin.s32 \t%r6, %r3, %r5;\n"));
  EXPECT_NE(parted.find("\tmin.s32 \t%r5, %r1, %r4;\n"), std::string::npos) << parted;
  EXPECT_EQ(count(parted, "min.s32"), 1u) << parted;
  EXPECT_NE(parted.find("\t{\n"
                        "\t.reg .b32 %part_a, %part_b;\n"
                        "\tmov.b32 %part_a, %r3;\n"
                        "\tmov.b32 %part_b, %r5;\n"
                        "\txor.b32 %part_a, %part_a, -2147483648;\n"
                        "\txor.b32 %part_b, %part_b, -2147483648;\n"
                        "\tmin.u32 %part_a, %part_a, %part_b;\n"
                        "\txor.b32 %r6, %part_a, -2147483648;\n"
                        "\t}\n"),
            std::string::npos)
      << parted;
}

TEST(NestedMinima, AreThoseOfEachTypeAndOfLoops) {
  for (const std::string name : {"min.s32", "max.s32", "min.s16", "max.s16"}) {
    const std::string chain = "\t" + name + " \t%a, %b, %c;\n\t" + name + " \t%d, %a, 5;\n",
                      loop = "$L__BB0_1:\n\t" + name +
                             " \t%d, %a, %c;\n\tmov.b32 \t%a, %d;\n\t@%p1 bra \t$L__BB0_1;\n";
    EXPECT_EQ(count(rewrite_nested_minima(function(chain)), name), 1u) << name;
    EXPECT_EQ(count(rewrite_nested_minima(function(loop)), name), 0u) << name;
  }
}

TEST(NestedMinima, EverythingElseIsAsItWas) {
  const std::string clamp =
      "\tmin.s32 \t%r2, %r1, 255;\n\tmax.s32 \t%r3, %r2, 0;\n\tmin.u32 \t%r4, %r1, %r2;\n"
      "\tmin.u32 \t%r5, %r4, %r2;\n\tmin.f32 \t%f2, %f1, %f1;\n\tmin.f32 \t%f3, %f2, %f1;\n"
      "\tmin.s64 \t%rd2, %rd1, %rd1;\n\tmin.s64 \t%rd3, %rd2, %rd1;\n";
  EXPECT_EQ(rewrite_nested_minima(function(clamp)), function(clamp));
  // Register names are local to a function.
  const std::string two =
      function("\tmin.s32 \t%r2, %r1, 255;\n") + function("\tmin.s32 \t%r3, %r2, 255;\n");
  EXPECT_EQ(rewrite_nested_minima(two), two);
  EXPECT_EQ(rewrite_nested_minima(""), "");
}

}  // namespace
}  // namespace retrograde::codegen
