// f(scatter(...)) = gather(...), as Halide documents it.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "autodiff/derivative.h"
#include "autodiff/tangents.h"
#include "graph/graph.h"
#include "support/errors.h"
#include "support/variables.h"
#include "testing/interpreter.h"

namespace retrograde {
namespace {

const Var lane("lane");

std::vector<int> values_of(Func& f, int n) {
  const Buffer<int> result = f.realize({n});
  return {result.begin(), result.end()};
}

TEST(SeveralPoints, EachGetsItsValue) {
  Func f("f");
  f(x, y) = 0;
  f(x, scatter(3, 4)) = gather(1, 2);
  const Buffer<int> result = f.realize({2, 5});
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(result(i, 2), 0);
    EXPECT_EQ(result(i, 3), 1);
    EXPECT_EQ(result(i, 4), 2);
  }
}

TEST(SeveralPoints, StandBetweenOperators) {
  Func f("f");
  RDom r(0, 2, 0, 2);
  f(x, y) = 0;
  f(2 * r.x + scatter(1, 0), 2 * r.y + scatter(0, 1)) = 2 * gather(r.x + 5, r.y + 7) + 1;
  const Buffer<int> result = f.realize({4, 4});
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(result(2 * i + 1, 2 * j), 2 * (i + 5) + 1);
      EXPECT_EQ(result(2 * i, 2 * j + 1), 2 * (j + 7) + 1);
      EXPECT_EQ(result(2 * i, 2 * j), 0);
    }
  }
}

TEST(SeveralPoints, TheLastOfTwoAtOnePlaceCounts) {
  Func f("f");
  f(x) = 0;
  f(scatter(2, 2)) = gather(3, 5);
  EXPECT_EQ(values_of(f, 4), (std::vector<int>{0, 0, 5, 0}));
}

TEST(SeveralPoints, ChangePlaces) {
  for (bool swaps : {true, false}) {
    Param<bool> p("p");
    p.set(swaps);
    Func f("f"), g("g");
    f(x) = 10 + x;
    f(scatter(3, 5)) = f(select(p, gather(5, 3), gather(3, 5)));
    EXPECT_EQ(values_of(f, 6), swaps ? (std::vector<int>{10, 11, 12, 15, 14, 13})
                                     : (std::vector<int>{10, 11, 12, 13, 14, 15}));
    g(x) = 10 + x;
    g(select(p, scatter(3, 5, 5), scatter(1, 2, 3))) =
        g(select(p, gather(5, 3, 3), gather(2, 3, 1)));
    EXPECT_EQ(values_of(g, 6), swaps ? (std::vector<int>{10, 11, 12, 15, 14, 13})
                                     : (std::vector<int>{10, 12, 13, 11, 14, 15}));
  }
}

TEST(SeveralPoints, OfTuplesAndUnderAPredicate) {
  Func f("f");
  RDom r(0, 4);
  r.where(r % 2 == 1);
  f(x) = Tuple(0, 1.0f);
  f(r + scatter(0, 10)) = Tuple(gather(r, -r), cast<float>(gather(r + 1, r + 2)));
  Realization result = f.realize({16});
  const Buffer<int> first = result[0];
  const Buffer<float> second = result[1];
  for (int i = 0; i < 16; ++i) {
    const bool is_first = i == 1 || i == 3, is_second = i == 11 || i == 13;
    EXPECT_EQ(first(i), is_first ? i : is_second ? 10 - i : 0);
    EXPECT_EQ(second(i), is_first ? float(i + 1) : is_second ? float(i - 8) : 1.0f);
  }
}

TEST(SeveralPoints, AddToWhatIsThere) {
  Func f("f");
  f(x) = x;
  f(scatter(0, 2)) += gather(10, 20);
  EXPECT_EQ(values_of(f, 4), (std::vector<int>{10, 1, 22, 3}));
}

TEST(SeveralPoints, HaveGradients) {
  Buffer<float> a(3);
  a.fill(2.0f);
  RDom r(0, 2), all(0, 4);
  Func f("f"), loss("loss");
  f(x) = 0.0f;
  f(r + scatter(0, 2)) = gather(a(r), a(r + 1) * a(r + 1));
  loss() = 0.0f;
  loss() += f(all) * cast<float>(all + 1);
  const Buffer<float> d = propagate_adjoints(loss)(a).realize({3});
  EXPECT_FLOAT_EQ(d(0), 1.0f);          // 1 a(0)
  EXPECT_FLOAT_EQ(d(1), 2.0f + 12.0f);  // 2 a(1) + 3 a(1)^2
  EXPECT_FLOAT_EQ(d(2), 16.0f);         // 4 a(2)^2
}

// ---- over an RDom, of a Func that reads itself ----

// The interpreter's values of f, as integers, the first dimension innermost.
std::vector<int64_t> interpreted(const Func& f, const oracle::Region& region, int value = 0) {
  oracle::Interpreter interpreter;
  const oracle::Array array = interpreter.realize(f.function(), region)[static_cast<size_t>(value)];
  std::vector<int64_t> result;
  for (const oracle::Value& v : array.values)
    result.push_back(static_cast<int64_t>(v.scalar.as_double()));
  return result;
}

template <class T>
std::vector<int64_t> numbers(const Buffer<T>& buffer) {
  std::vector<int64_t> result;
  for (const T v : buffer) result.push_back(static_cast<int64_t>(v));
  return result;
}

constexpr int wires = 6, columns = 20;

// A sorting network for six numbers: odd and even exchanges, in six rounds.
std::vector<std::pair<int, int>> network() {
  std::vector<std::pair<int, int>> links;
  for (int round = 0; round < wires; ++round) {
    for (int i = round % 2; i + 1 < wires; i += 2) links.emplace_back(i, i + 1);
  }
  return links;
}

struct Sorter {
  Buffer<int> links{2, static_cast<int>(network().size())}, in{columns, wires};
  RDom r{0, links.dim(1).extent(), "r"};
  Func f{"f"};

  Sorter() {
    for (size_t i = 0; i < network().size(); ++i) {
      const auto [low, high] = network()[i];
      links(0, static_cast<int>(i)) = low;
      links(1, static_cast<int>(i)) = high;
    }
    for (int j = 0; j < wires; ++j) {
      for (int i = 0; i < columns; ++i) in(i, j) = (i * 7 + j * 13 + i * j * 5) % 31;
    }
    f(x, y) = in(x, y);
    const Expr low = clamp(links(0, r), 0, wires - 1), high = clamp(links(1, r), 0, wires - 1);
    f(x, scatter(low, high)) = gather(min(f(x, low), f(x, high)), max(f(x, low), f(x, high)));
  }

  std::vector<int64_t> sorted() const {
    std::vector<int64_t> result(columns * wires);
    for (int i = 0; i < columns; ++i) {
      std::vector<int> column;
      for (int j = 0; j < wires; ++j) column.push_back(in(i, j));
      std::sort(column.begin(), column.end());
      for (int j = 0; j < wires; ++j) result[j * columns + i] = column[j];
    }
    return result;
  }
};

TEST(SeveralPoints, SortInANetwork) {
  const std::vector<std::function<void(Sorter&)>> schedules{
      [](Sorter&) {},
      [](Sorter& s) { s.f.update().vectorize(x, 8); },
      [](Sorter& s) { s.f.vectorize(x, 4).update().vectorize(x, 8, TailStrategy::GuardWithIf); },
      [](Sorter& s) { s.f.update().unroll(s.r); },
      [](Sorter& s) { s.f.update().unroll(s.r, 3).parallel(x); },
      [](Sorter& s) { s.f.update().reorder(s.r, x).parallel(x); },
      [](Sorter& s) { s.f.update().split(x, x, lane, 4).vectorize(lane).reorder(lane, s.r, x); },
      [](Sorter& s) { s.f.update().specialize(s.f.output_buffer().width() > 3).vectorize(x, 4); },
      [](Sorter& s) { s.f.update().atomic(true).vectorize(s.r, 2).parallel(x); },
  };
  for (const auto& schedule : schedules) {
    Sorter s;
    schedule(s);
    EXPECT_EQ(numbers(Buffer<int>(s.f.realize({columns, wires}))), s.sorted());
  }
  const Sorter s;
  EXPECT_EQ(interpreted(s.f, {{0, 0}, {columns, wires}}), s.sorted());
}

TEST(SeveralPoints, SortInsideOfAConsumer) {
  Sorter s;
  Func g("g");
  const Var tile("tile");
  g(x, y) = s.f(x, y) * 2;
  g.split(x, tile, x, 8).reorder(x, y, tile);
  s.f.compute_at(g, tile).update().vectorize(x, 4);
  std::vector<int64_t> expected = s.sorted();
  for (int64_t& v : expected) v *= 2;
  EXPECT_EQ(numbers(Buffer<int>(g.realize({columns, wires}))), expected);
  EXPECT_EQ(interpreted(g, {{0, 0}, {columns, wires}}), expected);
}

TEST(SeveralPoints, SortUnderTheBuiltInScheduler) {
  Sorter s;
  Func g("g");
  g(x, y) = s.f(x, y) + 1;
  g.set_estimate(x, 0, columns).set_estimate(y, 0, wires);
  Pipeline p(g);
  p.auto_schedule(get_host_target());
  std::vector<int64_t> expected = s.sorted();
  for (int64_t& v : expected) v += 1;
  EXPECT_EQ(numbers(Buffer<int>(p.realize({columns, wires}))), expected);
}

TEST(SeveralPoints, RotateASquareInPlace) {
  for (int n : {1, 2, 5, 8}) {
    Func f("f");
    RDom r(0, (n + 1) / 2, 0, n / 2);
    f(x, y) = x + 10 * y;
    const Expr last = n - 1;
    // A corner of each quarter, anticlockwise: each takes the value of the one before.
    const std::vector<Expr> xs{r.x, r.y, last - r.x, last - r.y};
    const std::vector<Expr> ys{r.y, last - r.x, last - r.y, r.x};
    const auto before = [](std::vector<Expr> all) {
      std::rotate(all.begin(), all.end() - 1, all.end());
      return gather(all);
    };
    f(scatter(xs), scatter(ys)) = f(before(xs), before(ys));
    const Buffer<int> result = f.realize({n, n});
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) EXPECT_EQ(result(i, j), (n - 1 - j) + 10 * i) << i << ", " << j;
    }
    EXPECT_EQ(interpreted(f, {{0, 0}, {n, n}}), numbers(result));
  }
}

struct Product {
  Buffer<uint8_t> in{2, 50};
  RDom r{0, 50, "r"};
  Func f{"f"};
  std::vector<int64_t> expected;

  Product() {
    uint8_t re = 1, im = 0;
    for (int i = 0; i < 50; ++i) {
      const auto a = in(0, i) = static_cast<uint8_t>(2 * i + 1),
                 b = in(1, i) = static_cast<uint8_t>(6 * i + 4);
      const auto next = static_cast<uint8_t>(re * a - im * b);
      im = static_cast<uint8_t>(re * b + im * a);
      re = next;
    }
    expected = {re, im};
    f(x) = cast<uint8_t>(select(x == 0, 1, 0));
    f(scatter(0, 1)) = gather(f(0) * in(0, r) - f(1) * in(1, r), f(0) * in(1, r) + f(1) * in(0, r));
  }
};

TEST(SeveralPoints, MultiplyComplexNumbers) {
  for (int schedule = 0; schedule < 4; ++schedule) {
    Product p;
    if (schedule == 1) p.f.update().unroll(p.r, 4);
    if (schedule == 2) p.f.update().atomic(true).parallel(p.r);
    if (schedule == 3) p.f.update().atomic(true).vectorize(p.r, 8).parallel(p.r);
    for (int run = 0; run < (schedule < 2 ? 1 : 20); ++run)
      ASSERT_EQ(numbers(Buffer<uint8_t>(p.f.realize({2}))), p.expected) << schedule;
  }
  EXPECT_EQ(interpreted(Product().f, {{0}, {2}}), Product().expected);
}

TEST(SeveralPoints, IterationsThatShareAPointTakeTurns) {
  // Threads move values to neighbouring elements; no value may be lost.
  constexpr int n = 16, moves = 4000;
  Func f("f");
  RDom r(0, moves);
  f(x) = 1;
  f(scatter(r % n, (r * 7 + 1) % n)) = gather(f(r % n) - 1, f((r * 7 + 1) % n) + 1);
  f.update().atomic(true).parallel(r);
  for (int run = 0; run < 10; ++run) {
    const std::vector<int> result = values_of(f, n);
    ASSERT_EQ(std::accumulate(result.begin(), result.end(), 0), n);
  }
}

TEST(SeveralPoints, SortTuplesWhereAConditionHolds) {
  constexpr int n = 24;
  Func f("f");
  f(x) = Tuple(11 - x % 7, cast<uint8_t>(x * 19));
  RDom r(0, n - 1, 0, n - 1);
  r.where(r.x < n - 1 - r.y);
  const Tuple here = f(r.x), next = f(r.x + 1);
  r.where(here[0] > next[0] || (here[0] == next[0] && here[1] > next[1]));
  f(scatter(r.x, r.x + 1)) = f(gather(r.x + 1, r.x));
  std::vector<std::pair<int, int>> expected;
  for (int i = 0; i < n; ++i) expected.emplace_back(11 - i % 7, (i * 19) % 256);
  std::sort(expected.begin(), expected.end());
  Realization result = f.realize({n});
  const Buffer<int> first = result[0];
  const Buffer<uint8_t> second = result[1];
  for (int i = 0; i < n; ++i) {
    EXPECT_EQ(first(i), expected[i].first);
    EXPECT_EQ(second(i), expected[i].second);
  }
  EXPECT_EQ(interpreted(f, {{0}, {n}}, 0), numbers(first));
  EXPECT_EQ(interpreted(f, {{0}, {n}}, 1), numbers(second));
}

TEST(SeveralPoints, TheLastOfTwoThatMeetCountsInEachIteration) {
  Func f("f");
  RDom r(0, 6);
  f(x) = 0;
  f(scatter(r / 2, r % 3)) += gather(1, 10);
  int expected[4] = {};
  for (int i = 0; i < 6; ++i) {
    const int a = i / 2, b = i % 3, first = expected[a] + 1, second = expected[b] + 10;
    expected[a] = first;
    expected[b] = second;
  }
  const std::vector<int> result = values_of(f, 4);
  EXPECT_EQ(result, std::vector<int>(expected, expected + 4));
  EXPECT_EQ(interpreted(f, {{0}, {4}}), (std::vector<int64_t>(result.begin(), result.end())));
}

TEST(SeveralPoints, MayHaveConditionsOfTheirOwn) {
  Func f("f"), g("g");
  RDom r(0, 5), s(0, 5);
  f(x) = x;
  f(scatter(r, r + 1, r + 2)) = gather(f(r + 2), undef<int>(), select(r > 2, undef<int>(), f(r)));
  g(x) = x;
  s.where(gather(s % 2 == 0, g(s) > 2));
  g(scatter(s, s + 1)) = g(gather(s + 1, s));
  int a[8], b[8];
  std::iota(a, a + 8, 0);
  std::iota(b, b + 8, 0);
  for (int i = 0; i < 5; ++i) {
    const int first = a[i + 2], third = a[i];
    a[i] = first;
    if (i <= 2) a[i + 2] = third;
    const int u = b[i + 1], v = b[i];
    const bool at_first = i % 2 == 0, at_second = b[i] > 2;
    if (at_first) b[i] = u;
    if (at_second) b[i + 1] = v;
  }
  EXPECT_EQ(values_of(f, 8), std::vector<int>(a, a + 8));
  EXPECT_EQ(values_of(g, 8), std::vector<int>(b, b + 8));
  EXPECT_EQ(interpreted(f, {{0}, {8}}), std::vector<int64_t>(a, a + 8));
  EXPECT_EQ(interpreted(g, {{0}, {8}}), std::vector<int64_t>(b, b + 8));
}

TEST(SeveralPoints, GatherAloneKeepsItsLast) {
  Func f("f"), g("g");
  RDom r(0, 3);
  f(x) = 0;
  f(3) = gather(1, 9);
  EXPECT_EQ(values_of(f, 5), (std::vector<int>{0, 0, 0, 9, 0}));
  g(x) = x;
  g(r) = g(gather(r + 2, r + 1));
  EXPECT_EQ(values_of(g, 5), (std::vector<int>{1, 2, 3, 3, 4}));
}

TEST(SeveralPoints, TheirNumberIsNoLoop) {
  Product p;
  EXPECT_EQ(p.f.rvars().size(), 1u);
  const std::string number = p.f.function()->updates[0].rvars.back().var;
  expect_error({number}, [&] { p.f.update().unroll(RVar(number)); });
  const Var u("u");
  expect_error({"several points at once"}, [&] { p.f.update().rfactor(p.r, u); });
  expect_error({"must not touch the same element"}, [&] { p.f.update().parallel(p.r); });
  expect_error({"must not touch the same element"}, [&] { p.f.update().vectorize(p.r, 2); });
  expect_error({"several points at once"}, [&] { p.f.update().atomic().parallel(p.r); });
}

TEST(SeveralPoints, AreKeptByTheTextOfGraphs) {
  const Sorter s;
  const graph::Graph written = graph::graph_of({s.f.function()});
  const graph::Graph read = graph::parse_graph(graph::to_text(written));
  EXPECT_EQ(graph::difference(written, read), "");
  graph::validate(read, "test");
  ASSERT_NE(graph::point_number(read.outputs[0]->updates[0]), nullptr);
}

struct Turn {
  Param<float> angle{"angle"};
  Func f{"f"}, loss{"loss"};
  RDom r{0, 3, "r"};
  Turn() {
    angle.set(0.25f);
    f(x) = select(x == 0, 1.0f, 0.0f);
    f(scatter(0, 1)) = gather(cos(angle * r) * f(0) - sin(angle * r) * f(1),
                              sin(angle * r) * f(0) + cos(angle * r) * f(1));
    loss() = f(1);
  }
};

TEST(SeveralPoints, HaveTangents) {  // a rotation by (0 + 1 + 2) angle
  Turn t;
  Func one("one");
  one() = 1.0f;
  const Buffer<float> value = t.loss.realize(std::vector<int>{});
  EXPECT_NEAR(value(), std::sin(0.75f), 1e-6f);
  const Buffer<float> d =
      propagate_tangents(t.loss, {{t.angle, one}})(t.loss).realize(std::vector<int>{});
  EXPECT_NEAR(d(), 3 * std::cos(0.75f), 1e-5f);
}

TEST(SeveralPoints, HaveAdjointsWhereTheyMayTakeTurns) {
  Buffer<float> a(4);
  for (int i = 0; i < 4; ++i) a(i) = 0.5f + static_cast<float>(i);
  Func f("f"), loss("loss");
  RDom r(0, 4), all(0, 8);
  f(x) = 1.0f + cast<float>(x);
  f(scatter(2 * r, 2 * r + 1)) += gather(a(r), a(r) * a(r));
  loss() = 0.0f;
  loss() += f(all);
  const Buffer<float> d = propagate_adjoints(loss)(a).realize({4});
  for (int i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(d(i), 1.0f + 2.0f * a(i));
}

TEST(SeveralPoints, HaveNoAdjointsAtOnce) {
  Turn t;
  expect_error<Unsupported>({"one point at a time", "updates 2 points", "custom_adjoint"},
                            [&] { propagate_adjoints(t.loss, {.wrt = {t.angle}}); });
}

}  // namespace
}  // namespace retrograde
