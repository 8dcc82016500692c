// Schedules that exercise the loop passes end to end: the scheduled pipeline gives the bits of the
// unscheduled one. Sizes are odd, so every split has a tail.
#include <gtest/gtest.h>

#include <algorithm>

#include <retrograde/retrograde.h>
#include <cstdlib>
#include <functional>

#include "support/errors.h"

namespace retrograde {
namespace {

constexpr int width = 37, height = 29;

class LoopSchedules : public testing::Test {
 protected:
  LoopSchedules() : input(width, height) {
    input.for_each_element([&](int i, int j) {
      input(i, j) = static_cast<float>((i * 37 + j * 11) % 53) * 0.25f - 3;
    });
  }

  Func edge() { return BoundaryConditions::repeat_edge(input); }

  // `make(true)` is the same program with a schedule.
  template <class T>
  static void expect_same(const std::function<Func(bool)>& make, int w = width, int h = height) {
    Buffer<T> expected = make(false).realize({w, h}), found = make(true).realize({w, h});
    expected.for_each_element(
        [&](int i, int j) { ASSERT_EQ(expected(i, j), found(i, j)) << i << " " << j; });
  }

  Buffer<float> input;
  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"}, xo{"xo"}, yo{"yo"}, i{"i"};
};

TEST_F(LoopSchedules, VectorsInTwoDimensions) {
  expect_same<float>([&](bool scheduled) {
    Func c = edge(), f("f");
    f(x, y) = c(x - 1, y) * 2.0f + c(x + 1, y + 1) * c(y, x);
    if (scheduled)
      f.tile(x, y, xo, yo, xi, yi, 4, 2, TailStrategy::GuardWithIf).vectorize(xi).vectorize(yi);
    return f;
  });
}

TEST_F(LoopSchedules, UnrolledRowsOfShiftedVectors) {
  expect_same<float>([&](bool scheduled) {
    Func c = edge(), f("f");
    f(x, y) = c(x - 1, y) * 2.0f + c(x + 1, y + 1) * c(y, x);
    if (scheduled) f.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi).unroll(yi).parallel(yo);
    return f;
  });
}

TEST_F(LoopSchedules, TilesOfEveryBoundaryCondition) {
  std::vector<std::function<Func()>> conditions = {
      [&] { return BoundaryConditions::repeat_edge(input); },
      [&] { return BoundaryConditions::constant_exterior(input, 5.0f); },
      [&] { return BoundaryConditions::mirror_image(input); },
      [&] { return BoundaryConditions::mirror_interior(input); },
      [&] { return BoundaryConditions::repeat_image(input); },
  };
  for (size_t k = 0; k < conditions.size(); ++k) {
    SCOPED_TRACE(k);
    auto make = [&](bool scheduled) {
      Func c = conditions[k](), f("f"), g("g");
      g(x, y) = c(x - 2, y) + c(x + 3, y - 1);
      f(x, y) = g(x, y - 1) + g(x, y + 1) * 2.0f;
      if (scheduled) {
        f.tile(x, y, xo, yo, xi, yi, 16, 8, TailStrategy::GuardWithIf)
            .vectorize(xi, 8)
            .parallel(yo);
        g.compute_at(f, xo).vectorize(x, 8);
      }
      return f;
    };
    expect_same<float>(make, 50, 40);  // beyond the input
  }
}

// A vector with different bounds in its two halves, read by a four-part one.
TEST_F(LoopSchedules, LanesThatAlternateInTwoWays) {
  Var x("x"), y("y"), xo("xo"), xi("xi"), xoo("xoo"), xoi("xoi"), t("t");
  Func f("f"), g("g");
  f(x, y) = x + 3 * y;
  Buffer<uint8_t> image(21, 16, 2);
  image.set_min(0, 0, -2);
  image.for_each_element([&](int i, int j, int k) { image(i, j, k) = i + 7 * j + 3 * k; });
  Func repeated = BoundaryConditions::repeat_image(image);
  g(x) = select(1 < f(x + 1, x - 3), cast<uint16_t>(f(0, clamp(f(x + 1, x - 3), 0, 11))),
                cast<uint16_t>(repeated(x, x * 2 + 1, x)));
  f.compute_root().fold_storage(y, 256);
  g.split(x, xo, xi, 2, TailStrategy::Predicate);
  g.split(xo, xoo, xoi, 4, TailStrategy::Predicate);
  g.fuse(xi, xoi, t).vectorize(t);
  Buffer<uint16_t> result = g.realize({21});
  const auto value = [](int i, int j) { return i + 3 * j; };
  for (int i = 0; i < 21; i++) {
    const int own = value(i + 1, i - 3);
    ASSERT_EQ(result(i),
              1 < own ? value(0, std::clamp(own, 0, 11)) : image(i, (i * 2 + 1) % 16, -2 + i % 2))
        << i;
  }
}

// The predicate is never true, which only range analysis can prove: g is not computed anywhere.
TEST_F(LoopSchedules, AnUpdateThatNeverRunsReadsNothing) {
  for (const bool is_scalar : {false, true}) {
    Var x("x"), y("y");
    Func f("f"), g("g");
    RDom r(1, 3);
    g(x) = x;
    g(x) += 1;
    r.where(11 < (r * 5) % -1);
    if (is_scalar) {
      f() = 7;
      f() += g(r);
      EXPECT_EQ(Buffer<int>(f.realize())(), 7);
    } else {
      f(x) = 7;
      f(x) += g(x + r);
      EXPECT_EQ(Buffer<int>(f.realize({3}))(2), 7);
    }
  }
}

// No iteration runs, although a condition mentions one: the region of s in y ends 4 before it
// begins.
TEST_F(LoopSchedules, AFuncThatNoIterationReadsTakesNoMemory) {
  Var x("x"), y("y");
  Func f("f"), s("s");
  RDom r(0, 2, 0, 0);
  s(x, y) = 1;
  s(x, y) += x * y;
  s.compute_root();
  f(x) = 7;
  f(r.x) = select(r.y == 4, s(r.x, r.y), undef<int>());
  EXPECT_EQ(Buffer<int>(f.realize({5}))(1), 7);
}

// An update that may run still reads and writes, also without dimensions.
TEST_F(LoopSchedules, AnUpdateOfAScalarThatRunsSometimes) {
  Var x("x");
  Func f("f"), g("g");
  RDom r(0, 10);
  g(x) = x;
  g(x) += 1;
  r.where(r % 3 == 1);
  f() = 7;
  f() += g(r);
  EXPECT_EQ(Buffer<int>(f.realize())(), 7 + 2 + 5 + 8);
}

TEST_F(LoopSchedules, LoopBoundsAndPredicatesThatVaryByLane) {
  auto triangle = [&](bool scheduled) {
    Func f("f");
    RDom r(0, 40);
    r.where(r.x < x + y % 3);
    f(x, y) = 0;
    f(x, y) += r.x * y;
    if (scheduled) f.update().vectorize(x, 8);
    return f;
  };
  expect_same<int>(triangle);
  expect_same<int>([&](bool scheduled) {
    Func f = triangle(false);
    Func g("g");
    g(x, y) = f(x, y);
    if (scheduled) {
      f.compute_root().update().vectorize(x, 8).parallel(y);
      g.vectorize(x, 8);
    }
    return g;
  });
}

TEST_F(LoopSchedules, TupleOfIndexAndMaximum) {
  expect_same<int>([&](bool scheduled) {
    Func c = edge(), m("m"), f("f");
    RDom r(0, 9);
    m(x, y) = Tuple(0, -100.0f);
    Expr v = c(x + r.x, y);
    m(x, y) = Tuple(select(v > m(x, y)[1], cast<int>(r.x), m(x, y)[0]), max(v, m(x, y)[1]));
    f(x, y) = m(x, y)[0];
    if (scheduled) {
      m.compute_root().vectorize(x, 8);
      m.update().reorder(x, r.x).vectorize(x, 8).parallel(y);
    }
    return f;
  });
}

TEST_F(LoopSchedules, ProducerInsideVectorLanes) {
  expect_same<float>([&](bool scheduled) {
    Func c = edge(), g("g"), f("f");
    g(x, y) = c(x, y) * 3.0f;
    f(x, y) = g(x - 1, y) + g(x + 1, y);
    if (scheduled) {
      f.split(x, xo, xi, 8).vectorize(xi);
      g.compute_at(f, xi);
    }
    return f;
  });
}

TEST_F(LoopSchedules, GathersFromATable) {
  expect_same<float>([&](bool scheduled) {
    Func c = edge(), table("table"), f("f");
    table(i) = cast<float>(i * i);
    f(x, y) = table(clamp(cast<int>(c(x, y) * 4.0f), 0, 20)) +
              table(cast<int>(clamp(c(x, y), 0.0f, 1.0f) * 15.0f));
    if (scheduled) {
      table.compute_root().vectorize(i, 8, TailStrategy::GuardWithIf);
      f.vectorize(x, 8).parallel(y);
    }
    return f;
  });
}

TEST_F(LoopSchedules, StencilWithHoles) {
  expect_same<float>([&](bool scheduled) {
    Func c = edge(), f("f");
    RDom r(-2, 5, -2, 5);
    r.where(r.x * r.x + r.y * r.y < 5);
    f(x, y) = 0.0f;
    f(x, y) += c(x + r.x, y + r.y);
    if (scheduled) {
      f.vectorize(x, 8).parallel(y);
      f.update().vectorize(x, 8).parallel(y).unroll(r.x);
    }
    return f;
  });
}

// The last tile, or a select, requires less of f than the other tiles do.
TEST_F(LoopSchedules, SmallStorageOfAnySizeIsNoHeapMemory) {
  struct Counting : JITUserContext {
    int allocations = 0;
  } context;
  context.handlers.custom_malloc = [](JITUserContext* c, size_t bytes) {
    static_cast<Counting*>(c)->allocations++;
    return std::malloc(bytes);
  };
  context.handlers.custom_free = [](JITUserContext*, void* memory) { std::free(memory); };
  Param<bool> far("far", true);
  Func f("f"), g("g"), heap("heap"), out("out");
  Var xo("xo"), xi("xi");
  f(x) = 3 * x;
  g(x) = x + 1;
  heap(x) = x + 2;
  out(x) = f(x) + g(select(far, 0, 2)) + g(0) + heap(0);
  out.split(x, xo, xi, 8, TailStrategy::GuardWithIf);
  f.compute_at(out, xo);
  g.compute_root();
  heap.compute_root().store_in(MemoryType::Heap);
  Buffer<int> result = out.realize(&context, {21});
  EXPECT_EQ(context.allocations, 1);
  for (int i = 0; i < 21; i++) EXPECT_EQ(result(i), 3 * i + 4) << i;
}

TEST_F(LoopSchedules, LoopsOfAnyExtentStayWhereUnrollingThemMayFail) {
  Func f("f");
  f(x) = 3 * x;
  f.unroll(x);
  expect_error<CompileError>({"the extent of an unrolled loop must be a constant"},
                             [&] { f.realize({17}); });
  ASSERT_EQ(setenv("HL_PERMIT_FAILED_UNROLL", "1", 1), 0);
  Buffer<int> result = f.realize({17});
  unsetenv("HL_PERMIT_FAILED_UNROLL");
  EXPECT_EQ(result(16), 48);
}

TEST_F(LoopSchedules, NarrowTypesWrapTheSame) {
  expect_same<uint8_t>([&](bool scheduled) {
    Func c = edge(), f("f");
    f(x, y) = cast<uint8_t>(cast<int>(c(x, y) * 100.0f) + x * y);
    if (scheduled) f.vectorize(x, 16).parallel(y);
    return f;
  });
}

// 24 lanes behind a predicate; the machine's gathers have 8 or 16.
TEST_F(LoopSchedules, GathersOfOddWidth) {
  Func values("values"), squares("squares"), f("f");
  Var z("z"), yo("yo"), yi("yi"), yoo("yoo"), yoi("yoi");
  RDom r(4, 2, 3, 2);
  values(x) = 0.125f;
  values(r[1]) = 3.0f;
  squares(x, y) = 1;
  squares(x, y) = cast<int>(values(x)) * cast<int>(values(x));
  f(x, y, z) = cast<float>(squares(y, y));
  squares.update(0)
      .split(y, yo, yi, 8, TailStrategy::PredicateStores)
      .split(yo, yoo, yoi, 8, TailStrategy::GuardWithIf)
      .vectorize(yoo, 3, TailStrategy::GuardWithIf)
      .vectorize(yi);
  Buffer<float> result = f.realize({1, 5, 1});
  for (int i = 0; i < 5; i++) EXPECT_EQ(result(0, i, 0), i == 3 || i == 4 ? 9.0f : 0.0f) << i;
}

}  // namespace
}  // namespace retrograde
