// The loop nests of schedules as text.
#include <gtest/gtest.h>

#include "lower/lower.h"
#include "retrograde/retrograde.h"
#include "support/loop_nest.h"

namespace retrograde {
namespace {

// Names are unique in the process ("f", "f$1"); the text is compared without their numbers.
std::string nest_of(const std::vector<Func>& outputs) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  return graph::without_numbers(lower::loop_nest_text(funcs));
}
std::string nest_of(const Func& f) { return nest_of(std::vector<Func>{f}); }

TEST(LoopNest, inlines_by_default) {
  Func f("f"), g("g");
  Var x("x"), y("y");
  f(x, y) = x + y;
  g(x, y) = f(x, y) * 2;
  EXPECT_EQ(nest_of(g),
            "produce g:\n"
            "  for y:\n"
            "    for x:\n"
            "      g(...) = ...\n");
}

TEST(LoopNest, computes_at_root_before_the_consumer) {
  Func f("f"), g("g");
  Var x("x");
  f(x) = x;
  g(x) = f(x) + f(x + 1);
  f.compute_root();
  EXPECT_EQ(nest_of(g),
            "produce f:\n"
            "  for x:\n"
            "    f(...) = ...\n"
            "consume f:\n"
            "  produce g:\n"
            "    for x:\n"
            "      g(...) = ...\n");
}

TEST(LoopNest, computes_inside_a_loop_of_the_consumer) {
  Func f("f"), g("g");
  Var x("x"), y("y");
  f(x, y) = x + y;
  g(x, y) = f(x, y) + f(x + 1, y);
  f.compute_at(g, y);
  EXPECT_EQ(nest_of(g),
            "produce g:\n"
            "  for y:\n"
            "    produce f:\n"
            "      for x:\n"
            "        f(...) = ...\n"
            "    consume f:\n"
            "      for x:\n"
            "        g(...) = ...\n");
}

TEST(LoopNest, says_where_a_func_is_stored) {
  Func f("f"), g("g");
  Var x("x"), y("y");
  f(x, y) = x + y;
  g(x, y) = f(x, y - 1) + f(x, y);
  f.store_root().compute_at(g, y);
  EXPECT_EQ(nest_of(g),
            "store f:\n"
            "  produce g:\n"
            "    for y:\n"
            "      produce f:\n"
            "        for x:\n"
            "          f(...) = ...\n"
            "      consume f:\n"
            "        for x:\n"
            "          g(...) = ...\n");
}

TEST(LoopNest, shows_splits_and_loop_types) {
  Func f("f");
  Var x("x"), y("y"), xo("xo"), xi("xi");
  f(x, y) = x + y;
  f.split(x, xo, xi, 8).vectorize(xi).parallel(y);
  EXPECT_EQ(nest_of(f),
            "produce f:\n"
            "  parallel y:\n"
            "    for x.xo:\n"
            "      vectorized x.xi in [0, 7]:\n"
            "        f(...) = ...\n");
}

TEST(LoopNest, computes_a_reduction_in_the_innermost_loop_of_its_consumer) {
  Func f("f"), g("g");
  Var x("x");
  RDom r(0, 5, "r");
  f(x) = 0;
  f(x) += x * r;
  g(x) = f(x);
  EXPECT_EQ(nest_of(g),
            "produce g:\n"
            "  for x:\n"
            "    produce f:\n"
            "      f(...) = ...\n"
            "      for r in [0, 4]:\n"
            "        f(...) = ...\n"
            "    consume f:\n"
            "      g(...) = ...\n");
}

// The memory of temp is freed before that of other is allocated.
TEST(LoopNest, computes_an_output_as_soon_as_what_it_reads_is_there) {
  Func temp("temp"), other("other"), early("early"), late("late");
  Var x("x");
  temp(x) = x * x;
  other(x) = x + x;
  late(x) = other(x) * 3;
  early(x) = temp(x) + 1;
  temp.compute_root();
  other.compute_root();
  Func both("both");
  both(x) = late(x) + temp(x);
  EXPECT_EQ(names_in_nest(nest_of({both, early}), "produce"),
            (std::vector<std::string>{"other", "temp", "early", "both"}));
  Func last("last");
  last(x) = other(x) - 1;
  EXPECT_EQ(names_in_nest(nest_of({early, last, both}), "produce"),
            (std::vector<std::string>{"temp", "early", "other", "both", "last"}));
}

}  // namespace
}  // namespace retrograde
