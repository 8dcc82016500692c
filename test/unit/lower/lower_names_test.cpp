// Funcs that are computed in several places get distinct names.
#include <gtest/gtest.h>

#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "lower/nests/make_names_unique.h"
#include "lower/program.h"
#include "retrograde/retrograde.h"

namespace retrograde {
namespace {

TEST(MakeNamesUnique, RenamesAllButTheFirstBinding) {
  Stmt s = ir::parse_stmt(
      "for (x, 0, 4) { out(x) = {x} } "
      "realize f(int32) auto [0, 4] { for (x, 0, 4) { f(x) = {x} } "
      "realize f(int32) auto [0, 2] { f(1) = {3} out(0) = {f(1).0:int32} } out(1) = {f(2).0:int32} "
      "}");
  const Stmt found = lower::make_names_unique(s);
  const Stmt expected = ir::parse_stmt(
      "for (x, 0, 4) { out(x) = {x} } "
      "realize f(int32) auto [0, 4] { for (x.$1, 0, 4) { f(x.$1) = {x.$1} } "
      "realize f.$1(int32) auto [0, 2] { f.$1(1) = {3} out(0) = {f.$1(1).0:int32} } "
      "out(1) = {f(2).0:int32} }");
  EXPECT_TRUE(ir::equal(found, expected)) << ir::print(found);
}

TEST(MakeNamesUnique, TheOriginalNameFollowsFromTheNewOne) {
  EXPECT_EQ(lower::original_name("f.$12"), "f");
  for (const char* name : {"f", "f$3", "f.0", "f.$", "f.$1.min.0"})
    EXPECT_EQ(lower::original_name(name), name);
}

TEST(MakeNamesUnique, LeavesNamesOfArgumentsToThem) {
  Stmt s = ir::parse_stmt("{ let code = 3 assert((code == 0), code) } out(0) = {code:int32}");
  const Stmt found = lower::make_names_unique(s, {"code"});
  const Stmt expected =
      ir::parse_stmt("{ let code.$1 = 3 assert((code.$1 == 0), code.$1) } out(0) = {code:int32}");
  EXPECT_TRUE(ir::equal(found, expected)) << ir::print(found);
}

// The results of argument checks have names of their own.
TEST(MakeNamesUnique, AParameterMayBeCalledCode) {
  Param<int> code("code", 113);
  Var x("x");
  Func f("f");
  f(x) = code + x;
  const Buffer<int> found = f.realize({3});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(found(i), 113 + i);
}

// Reduced by the fuzzer: f is computed innermost both in g and in the sum that g reads.
TEST(MakeNamesUnique, AnUpdateThatIsComputedInTwoStagesAtOnce) {
  Var x("x"), y("y");
  Func f("f"), g("g");
  RDom r(0, 3);
  f(x, y) = 1;
  f(x, 5) = 2;
  g(x, y) = Tuple(cast<float>(f(x, y)), sum(f(x, y + r)));
  Realization result = g.realize({4, 8});
  Buffer<float> first = result[0];
  Buffer<int> second = result[1];
  for (int j = 0; j < 8; j++) {
    for (int i = 0; i < 4; i++) {
      EXPECT_EQ(first(i, j), j == 5 ? 2.0f : 1.0f);
      EXPECT_EQ(second(i, j), j >= 3 && j <= 5 ? 4 : 3);
    }
  }
}

}  // namespace
}  // namespace retrograde
