// The loop nests of schedules as text.
#include <gtest/gtest.h>

#include "lower/lower.h"
#include "retrograde/retrograde.h"

namespace retrograde {
namespace {

std::string nest_of(const Func& f) { return lower::loop_nest_text({f.function()}); }

// Names are unique in the process ("f", "f$1"), so the text is compared with every "$N" taken out.
std::string without_numbers(const std::string& text) {
  std::string result;
  for (size_t i = 0; i < text.size(); i++) {
    if (text[i] != '$') {
      result += text[i];
      continue;
    }
    while (i + 1 < text.size() && isdigit(text[i + 1])) i++;
  }
  return result;
}

TEST(LoopNest, inlines_by_default) {
  Func f("f"), g("g");
  Var x("x"), y("y");
  f(x, y) = x + y;
  g(x, y) = f(x, y) * 2;
  EXPECT_EQ(without_numbers(nest_of(g)),
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
  EXPECT_EQ(without_numbers(nest_of(g)),
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
  EXPECT_EQ(without_numbers(nest_of(g)),
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
  EXPECT_EQ(without_numbers(nest_of(g)),
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
  EXPECT_EQ(without_numbers(nest_of(f)),
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
  EXPECT_EQ(without_numbers(nest_of(g)),
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
  const std::string nest =
      without_numbers(lower::loop_nest_text({both.function(), early.function()}));
  EXPECT_LT(nest.find("produce early"), nest.find("produce both")) << nest;
  EXPECT_LT(nest.find("produce temp"), nest.find("produce early")) << nest;
  EXPECT_NE(nest.find("produce both"), std::string::npos) << nest;
  Func last("last");
  last(x) = other(x) - 1;
  const std::string order =
      without_numbers(lower::loop_nest_text({early.function(), last.function(), both.function()}));
  EXPECT_LT(order.find("produce early"), order.find("produce other")) << order;
}

}  // namespace
}  // namespace retrograde
