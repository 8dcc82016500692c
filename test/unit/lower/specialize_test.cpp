// Specializations: each branch runs its own loops over its own definition, and all give the same
// values.
#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/errors.h"
#include "support/loop_nest.h"

namespace retrograde {
namespace {

void expect_values(const Buffer<int>& found, int (*value)(int, int)) {
  found.for_each_element(
      [&](int i, int j) { ASSERT_EQ(found(i, j), value(i, j)) << i << " " << j; });
}

class Specialize : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"};
};

TEST_F(Specialize, RunsTheBranchThatFits) {
  Param<bool> doubled("doubled");
  Func f("f");
  f(x, y) = select(doubled, 2 * x + y, x + y);
  f.specialize(doubled).split(x, xo, xi, 4, TailStrategy::GuardWithIf).vectorize(xi);
  doubled.set(true);
  expect_values(f.realize({13, 5}), [](int i, int j) { return 2 * i + j; });
  doubled.set(false);
  expect_values(f.realize({13, 5}), [](int i, int j) { return i + j; });
}

TEST_F(Specialize, ComputesOnlyWhatItsBranchReads) {
  Param<int> which("which");
  Func f("f"), g("g"), h("h");
  g(x, y) = x + y;
  h(x, y) = x * y;
  f(x, y) = select(which == 1, Expr(g(x, y)), Expr(h(x, y)));
  g.compute_root();
  h.compute_root();
  f.specialize(which == 1);
  f.specialize(which == 2);
  EXPECT_EQ(names_in_nest(f.loop_nest(), "produce"), (std::vector<std::string>{"g", "h", "f"}));
  for (int value : {1, 2, 3}) {
    which.set(value);
    if (value == 1) expect_values(f.realize({9, 4}), [](int i, int j) { return i + j; });
    if (value != 1) expect_values(f.realize({9, 4}), [](int i, int j) { return i * j; });
  }
}

TEST_F(Specialize, ProducersAreComputedInEveryBranch) {
  Param<int> n("n");
  Func f("f"), g("g");
  g(x, y) = x + 3 * y;
  f(x, y) = g(x, y) + g(x, y + 1) * n;
  g.compute_at(f, y);
  f.specialize(n > 5).vectorize(x, 8);
  f.specialize(n > 2).parallel(y);
  for (int value : {1, 4, 9}) {
    n.set(value);
    Buffer<int> found = f.realize({19, 6});
    found.for_each_element([&](int i, int j) {
      ASSERT_EQ(found(i, j), i + 3 * j + (i + 3 * (j + 1)) * value) << value;
    });
  }
}

TEST_F(Specialize, SlidesInEveryBranch) {
  Param<bool> wide("wide");
  Func f("f"), g("g");
  g(x, y) = x + 3 * y;
  f(x, y) = g(x, y - 1) + g(x, y + 1);
  g.store_root().compute_at(f, y);
  f.specialize(wide).vectorize(x, 8);
  for (bool value : {false, true}) {
    wide.set(value);
    expect_values(f.realize({19, 6}), [](int i, int j) { return 2 * i + 6 * j; });
  }
}

TEST_F(Specialize, UpdatesAndNestedConditions) {
  Param<int> n("n");
  Param<bool> p("p");
  Func f("f");
  RDom r(0, 6);
  f(x, y) = x;
  f(x, y) += select(p, r.x, 2 * r.x) + n;
  Stage big = f.update().specialize(n > 3);
  big.parallel(y);
  big.specialize(p).vectorize(x, 4);
  f.update().specialize(n == 2).reorder(x, r.x);
  for (int value : {1, 2, 5}) {
    for (bool flag : {false, true}) {
      n.set(value);
      p.set(flag);
      Buffer<int> found = f.realize({10, 3});
      for (int i = 0; i < 10; ++i) ASSERT_EQ(found(i, 2), i + (flag ? 15 : 30) + 6 * value);
    }
  }
}

TEST_F(Specialize, OnTheSizeOfTheOutput) {
  Func f("f");
  f(x, y) = x - y;
  f.specialize(f.output_buffer().width() >= 16).split(x, xo, xi, 16).vectorize(xi);
  expect_values(f.realize({5, 2}), [](int i, int j) { return i - j; });
  expect_values(f.realize({37, 2}), [](int i, int j) { return i - j; });
}

TEST_F(Specialize, ConditionsAreFactsInTheirBranches) {
  ImageParam in(Int(32), 3, "in");
  Var c("c");
  Func f("f"), g("g");
  g(x, y, c) = in(x, y, c) * 2;
  f(x, y, c) = g(x, y, c) + c;
  const auto channels = f.output_buffer().dim(2);
  f.reorder(c, x, y).specialize(channels.extent() == 3).unroll(c);
  f.specialize(channels.extent() % 2 == 0 && in.dim(0).stride() == 4).vectorize(x, 4);
  g.compute_at(f, x);
  in.dim(0).set_stride(Expr());
  for (int n : {3, 4, 5}) {
    Buffer<int> image = Buffer<int>::make_interleaved(7, 5, n);
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < 5; ++j) {
        for (int i = 0; i < 7; ++i) image(i, j, k) = 100 * k + 10 * j + i;
      }
    }
    in.set(image);
    Buffer<int> found = f.realize({7, 5, n});
    for (int i = 0; i < 7; ++i) ASSERT_EQ(found(i, 4, n - 1), 2 * (100 * (n - 1) + 40 + i) + n - 1);
  }
}

// Later branches too, where the failure of the earlier conditions is known.
TEST_F(Specialize, CompoundConditionsAreFactsInLaterBranches) {
  struct Counting : JITUserContext {
    int loads = 0;
  } context;
  context.handlers.custom_trace = [](JITUserContext* to, const halide_trace_event_t* event) {
    static_cast<Counting*>(to)->loads += event->event == halide_trace_load;
    return 1;
  };
  Param<float> across("across"), down("down");
  ImageParam in(Int(32), 2, "in");
  Buffer<int> image(16, 16);
  image.for_each_element([&](int i, int j) { image(i, j) = i + 100 * j; });
  in.set(image);
  in.trace_loads();
  const Expr wide = across > 1.0f, high = down > 1.0f;
  const Expr grows = wide && high, shrinks = !wide && !high;
  Func f("f");
  f(x, y) = select(grows, in(x / 2, y / 2), select(shrinks, in(x * 2, y * 2), 0));
  f.specialize(grows && !shrinks);
  f.specialize(!grows && shrinks);
  f.specialize(!grows && !shrinks);
  const auto loads_at = [&](float a, float d, int (*value)(int, int)) {
    across.set(a);
    down.set(d);
    context.loads = 0;
    expect_values(Buffer<int>(f.realize(&context, {8, 8})), value);
    return context.loads;
  };
  EXPECT_EQ(loads_at(2, 2, [](int i, int j) { return i / 2 + 100 * (j / 2); }), 64);
  EXPECT_EQ(loads_at(0.5f, 0.5f, [](int i, int j) { return 2 * i + 200 * j; }), 64);
  loads_at(0.5f, 2, [](int, int) { return 0; });
}

TEST_F(Specialize, FailsWhenNoneFits) {
  Param<int> n("n");
  Func f("f");
  f(x, y) = x + n;
  f.specialize(n == 1);
  f.specialize_fail("n must be 1");
  n.set(1);
  expect_values(f.realize({5, 2}), [](int i, int) { return i + 1; });
  n.set(2);
  try {
    f.realize({5, 2});
    FAIL() << "nothing was thrown";
  } catch (const RuntimeError& e) {
    expect_mentions(e.what(), {"n must be 1", "specialization"});
  }
}

}  // namespace
}  // namespace retrograde
