// Tests adjoints that sum millions of float32 terms: they are right to 1e-6 of the sum of absolute values, under every
// schedule, as gathers and as scatters. The expected values are the same terms, added in long double.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "graph/copy_graph.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "support/facts.h"

namespace retrograde {
namespace {

constexpr int many = 12'000'000;
constexpr float huge =
    5e36f;  // two lanes of a block can add up terms of this size without overflow

struct Nature {
  const char* name;
  std::function<float(int)> term;  // number i
};
const std::vector<Nature>& natures() {
  static const std::vector<Nature> all = {
      {"constant", [](int) { return 0.1f; }},
      {"random", [](int i) { return static_cast<float>((i * 2654435761u) >> 8) * 0x1p-24f; }},
      {"growing", [](int i) { return static_cast<float>(i) * 1e-7f; }},
      {"one huge among small", [](int i) { return i == 5 ? 1e7f : 0.3f; }},
      {"big ones that cancel", [](int i) { return i % 2   ? 0.1f
                                                  : i % 4 ? 1e6f
                                                          : -1e6f; }},
      {"overflowing but for the end", [](int i) { return i % 2000 < 1000 ? huge : -huge; }},
  };
  return all;
}

using Terms = std::vector<float>;
Terms terms_of(const Nature& nature, int count = many) {
  Terms result(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) result[static_cast<size_t>(i)] = nature.term(i);
  return result;
}

// Checks sums in which term i belongs to element i % elements.
void expect_sums(const Buffer<float>& found, const Terms& terms) {
  const size_t elements = static_cast<size_t>(found.width());
  std::vector<long double> value(elements), absolute(elements);
  for (size_t i = 0, e = 0; i < terms.size(); ++i, e = e + 1 == elements ? 0 : e + 1) {
    value[e] += static_cast<long double>(terms[i]);
    absolute[e] += std::fabs(static_cast<long double>(terms[i]));
  }
  for (size_t e = 0; e < elements; ++e) {
    const float actual = found(static_cast<int>(e));
    EXPECT_LE(std::fabs(static_cast<long double>(actual) - value[e]), 1e-6L * absolute[e])
        << "element " << e << ": " << actual << " instead of " << value[e];
  }
}

using Schedule = std::function<void(Func)>;  // schedules the Func that sums

// loss = sum over e and row of gain(e) * terms(e, row): the gradient sums each column.
void check_gather(int elements, Terms& terms, const Schedule& schedule = nullptr) {
  const int rows = static_cast<int>(terms.size()) / elements;
  Var x("x"), y("y");
  Func scaled("scaled"), loss("loss");
  Buffer<float> gain(elements), columns(terms.data(), elements, rows);
  gain.fill(1);
  RDom r(0, elements, 0, rows);
  scaled(x, y) = gain(x) * columns(x, y);
  loss() = 0.0f;
  loss() += scaled(r.x, r.y);
  Derivative d = propagate_adjoints(loss);
  if (schedule) schedule(d.accumulator(d(gain)));
  expect_sums(d(gain).realize({elements}), terms);
}

// loss = sum over i of table(i % elements, data-dependent) * terms(i)
void check_scatter(int elements, Terms& terms) {
  Func loss("loss");
  Buffer<float> table(elements), all(terms.data(), static_cast<int>(terms.size()));
  Buffer<int> place(elements);
  table.fill(1);
  std::iota(place.begin(), place.end(), 0);
  RDom r(0, static_cast<int>(terms.size()));
  loss() = 0.0f;
  loss() += table(clamp(place(r % elements), 0, elements - 1)) * all(r);
  Derivative d = propagate_adjoints(loss);
  expect_fact(d.explanations(), Fact::Scattered, table.name(),
              text("read by \"", loss.name(), "\": an index depends on \"", place.name(), "\""));
  expect_sums(d(table).realize({elements}), terms);
}

TEST(LongSums, OfEveryNatureUnderTheDefaultSchedule) {
  for (const Nature& nature : natures()) {
    SCOPED_TRACE(nature.name);
    Terms terms = terms_of(nature, many / 4);
    check_gather(1, terms);
  }
  Terms terms = terms_of(natures()[0]);
  check_gather(1, terms);
  check_gather(200, terms);
}

TEST(LongSums, OfScattersToFewAndToManyElements) {
  Terms constant = terms_of(natures()[0]), cancelling = terms_of(natures()[4], many / 4);
  check_scatter(3, constant);
  check_scatter(3, cancelling);
  check_scatter(1000, cancelling);
}

// Blocks of terms are added in float32, and their sums in double. Blocks are longer if a lane has many terms.
TEST(LongSums, HaveBlocksOf32TermsAndShortOnesOf16) {
  const auto terms_of_a_block = [](int columns, int rows) {
    Var x("x");
    Func loss("loss"), sums("sums");
    Buffer<float> gain(1000), all(1000, columns, rows);
    gain.fill(1);
    RDom r(0, columns, 0, rows), all_sums(0, 1000);
    sums(x) += gain(x) * all(x, r.x, r.y);
    loss() += sums(all_sums);
    Derivative d = propagate_adjoints(loss);
    int64_t terms = 0;
    for (const graph::FuncPtr& f : graph::topological_order({d(gain).function()})) {
      if (!f->made || f->made->blocks == 0) continue;
      terms = 1;
      for (const graph::ReductionVariable& loop : f->updates[0].rvars)
        terms *= *ir::as_const_int(loop.extent);
    }
    return terms;
  };
  EXPECT_EQ(terms_of_a_block(1024, 256), 32);
  EXPECT_EQ(terms_of_a_block(64, 128), 16) << "a part has 256 terms";
  EXPECT_EQ(terms_of_a_block(16, 64), 0) << "of which none is worth it";
}

// Sums of columns fill vectors with their elements; sums of rows fill them with terms, in lanes.
TEST(LongSums, HaveLanesIfElementsAreStrided) {
  const auto has_lanes = [](bool along_rows) {
    constexpr int elements = 1000, terms = 5000;
    Var x("x"), y("y");
    Func out("out"), seed("seed");
    Buffer<float> gain(elements);
    Buffer<float> all =
        along_rows ? Buffer<float>(terms, elements) : Buffer<float>(elements, terms);
    out(x, y) = along_rows ? gain(y) * all(x, y) : gain(x) * all(x, y);
    seed(x, y) = 1.0f;
    const Derivative d = propagate_adjoints(out, seed, {{0, all.width()}, {0, all.height()}});
    return std::ranges::any_of(
        graph::topological_order({d(gain).function()}),
        [](const graph::FuncPtr& f) { return f->made && f->made->lanes > 0; });
  };
  EXPECT_TRUE(has_lanes(true));
  EXPECT_FALSE(has_lanes(false));
}

TEST(LongSums, UnderSchedulesByHand) {
  Terms terms = terms_of(natures()[0], many / 4);
  Var part("part"), xo("xo"), xi("xi");
  RVar outer("outer"), inner("inner");
  const std::vector<Schedule> schedules = {
      [](Func f) { f.compute_root(); },
      [](Func f) { f.compute_root().update().parallel(f.args()[0]); },
      [](Func f) { f.compute_root().update().vectorize(f.args()[0], 8); },
      [&](Func f) {
        f.compute_root().update().split(f.args()[0], xo, xi, 8).reorder(xi, f.rvars()[0], xo);
        f.update().vectorize(xi).parallel(xo);
      },
      [&](Func f) {
        f.compute_root().update().split(f.rvars()[0], outer, inner, 1000);
        Func parts = f.update().rfactor(outer, part);
        parts.compute_root().parallel(part).update().parallel(part);
      },
      [](Func f) { f.compute_root().update().atomic().vectorize(f.rvars()[0], 8); },
  };
  for (size_t s = 0; s < schedules.size(); ++s) {
    SCOPED_TRACE("schedule " + std::to_string(s));
    check_gather(200, terms, schedules[s]);
  }
}

// ---- sums that are carried from element to element ----

// loss = sum of terms(i) * f(i), where f is the running sum of a: the gradient by a sums the terms from each element
// on, accumulated as a suffix sum.
TEST(CarriedSums, OfAPrefixSumAreRight) {
  for (const Nature& nature : {natures()[0], natures()[1], natures()[4]}) {
    SCOPED_TRACE(nature.name);
    Terms terms = terms_of(nature);
    Var x("x");
    Func f("f"), loss("loss");
    Buffer<float> a(many), weights(terms.data(), many);
    a.fill(1);
    RDom r(1, many - 1), all(0, many);
    f(x) = a(x);
    f(r) += f(r - 1);
    loss() = 0.0f;
    loss() += f(all) * weights(all);
    Buffer<float> found = propagate_adjoints(loss, {.wrt = {a}})(a).realize({many});
    long double value = 0, absolute = 0, worst = 0;
    for (int i = many - 1; i >= 0; --i) {
      value += static_cast<long double>(terms[static_cast<size_t>(i)]);
      absolute += std::fabs(static_cast<long double>(terms[static_cast<size_t>(i)]));
      worst = std::max(worst, std::fabs(static_cast<long double>(found(i)) - value) / absolute);
    }
    EXPECT_LE(worst, 1e-6L);
  }
}

// The gradient by the corner of a summed-area table sums 12 million terms.
TEST(CarriedSums, OfASummedAreaTableAreRight) {
  const int n = 3464;
  Var x("x"), y("y");
  Func f("f"), loss("loss");
  Buffer<float> a(n, n);
  a.fill(1);
  RDom rx(1, n - 1), ry(1, n - 1), r(0, n, 0, n);
  f(x, y) = a(x, y);
  f(rx, y) += f(rx - 1, y);
  f(x, ry) += f(x, ry - 1);
  loss() = 0.0f;
  loss() += f(r.x, r.y) * 0.1f;
  Buffer<float> found = propagate_adjoints(loss, {.wrt = {a}})(a).realize({n, n});
  for (int at : {0, 1, 700, n - 1}) {
    const double expected = static_cast<double>(0.1f) * (n - at) * n;
    EXPECT_NEAR(found(at, 0), expected, 1e-6 * expected) << at;
    EXPECT_NEAR(found(0, at), expected, 1e-6 * expected) << at;
  }
}

// f(i) = f(i - 1) + (keep(i) - 1) f(i - 1): a factor that is not constant may be 1 everywhere. f is one value of a
// Tuple, whose other value decays.
TEST(CarriedSums, OfFactorsThatDataGiveAreRight) {
  const int n = 3'000'000;
  Var x("x");
  Func f("f"), loss("loss");
  Buffer<float> a(n), keep(n);
  a.fill(1);
  keep.fill(1);
  RDom r(1, n - 1), all(0, n);
  f(x) = Tuple(a(x), a(x));
  f(r) = Tuple(f(r)[0] + keep(r) * f(r - 1)[0] + 0.0f * f(r - 1)[1], 0.5f * f(r - 1)[1]);
  loss() = 0.0f;
  loss() += f(all)[0] * 0.1f + f(all)[1] * 0.1f;
  Buffer<float> found = propagate_adjoints(loss, {.wrt = {a}})(a).realize({n});
  for (int i : {1, 17, 1000, n / 2}) {
    const double expected = static_cast<double>(0.1f) * (n - i);
    EXPECT_NEAR(found(i), expected, 1e-6 * expected) << i;
  }
}

Derivative filter_gradient(const Buffer<float>& a, float decay, int length) {
  Var x("x");
  Func f("f"), loss("loss");
  RDom r(1, length - 1), all(0, length);
  f(x) = a(x);
  f(r) = (1 - decay) * f(r) + decay * f(r - 1);
  loss() = 0.0f;
  loss() += f(all);
  return propagate_adjoints(loss, {.wrt = {a}});
}

const std::string carried =
                      "update 0: its adjoint carries long sums from element to element, in double",
                  recurrence = "update 0 is a recurrence: its adjoint runs backward";

// Scans that are damped by a constant below 1, or that carry few elements, stay in float32. The carried term uses each
// value of the step twice; expanded as a tree it would have 2^40 nodes.
TEST(CarriedSums, OfStepsThatUseTheirValuesTwiceAreFoundInTime) {
  const int n = 100;
  Buffer<float> input(n);
  input.fill(1);
  Var x("x");
  Func f("f"), loss("loss");
  RDom r(1, n - 1), all(0, n);
  f(x) = input(x);
  Expr step = f(r - 1);
  for (int i = 0; i < 40; ++i) step = step * 0.5f + step * 0.5f;
  f(r) = f(r) + step;
  loss() = 0.0f;
  loss() += f(all);
  Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(details_of(d.explanations(), Fact::Version),
            (std::vector<std::string>{carried, recurrence}));
  Buffer<float> found = d(input).realize({n});
  for (int i = 0; i < n; ++i) EXPECT_EQ(found(i), static_cast<float>(n - i)) << i;
}

TEST(CarriedSums, ThatAreShortStayInFloat32) {
  Buffer<float> a(100'000);
  const auto versions = [&](float decay, int length) {
    return details_of(filter_gradient(a, decay, length).explanations(), Fact::Version);
  };
  EXPECT_EQ(versions(0.9f, 100'000), std::vector<std::string>{recurrence});
  EXPECT_EQ(versions(0.99f, 100'000), (std::vector<std::string>{carried, recurrence}));
  EXPECT_EQ(versions(0.99f, 63), std::vector<std::string>{recurrence});
}

TEST(LongSums, ShortOnesStayInFloat32) {
  Var x("x");
  Func blur("blur"), loss("loss");
  Buffer<float> a(10010), b(10000);
  RDom taps(0, 9), r(0, 10000);
  blur(x) = 0.0f;
  blur(x) += a(x + taps) * b(taps);
  loss() = 0.0f;
  loss() += blur(r);
  Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(d.accumulator(d(a)).name(), d(a).name());
  EXPECT_EQ(d.accumulator(d(b)).types()[0], Float(64));
  EXPECT_EQ(d(b).types()[0], Float(32));
  expect_fact(d.explanations(), Fact::Built, b.name(),
              text('"', d.accumulator(d(b)).name(), "\" accumulates in double, and \"", d(b).name(),
                   "\" rounds the sum once, because an element may sum many terms"));
}

// loss = sum of p h(i), computed in 16 bits: neither the gradient by p nor a sum of three values each can be
// accumulated in 16 bits, and both exceed its range.
void check_narrow(Type type, int count) {
  Var x("x");
  Func narrow("narrow"), scaled("scaled"), spread("spread"), loss("loss");
  Buffer<float> p(1), values(count);
  p(0) = 1;
  values.fill(0.1f);
  RDom r(0, count), taps(0, 3);
  narrow(x) = cast(type, values(clamp(x, 0, count - 1)));
  scaled(x) = cast(type, p(Expr(0))) * narrow(x);
  spread(x) = cast(type, 0);
  spread(x) += scaled(x + taps);
  loss() = 0.0f;
  loss() += cast<float>(spread(r));
  Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(d(p).types()[0], Float(32));
  EXPECT_EQ(d(scaled).types()[0], Float(32));
  EXPECT_EQ(d(narrow).types()[0], Float(32));
  const double tenth = type.is_bfloat() ? 0x1.9ap-4 : 0x1.998p-4, expected = 3.0 * count * tenth;
  Buffer<float> gradient = d(p).realize({1});
  EXPECT_NEAR(gradient(0), expected, 1e-5 * expected);
}

TEST(LongSums, PipelinesInSixteenBitsAccumulateInAtLeastFloat32) {
  for (Type type : {Float(16), BFloat(16)}) {
    check_narrow(type, 1000);
    check_narrow(type, 300'000);
  }
}

// loss = sum of exp(p t_i): d2/dp2 = sum of t_i^2 exp(p t_i), through the sum in double.
TEST(LongSums, DifferentiateAgain) {
  Terms terms(many, 0.1f);  // exp(0) is 1
  Buffer<float> p(1), all(terms.data(), many);
  p(0) = 0;
  Func loss("loss"), slope("slope");
  RDom r(0, many);
  loss() = 0.0f;
  loss() += exp(p(Expr(0)) * all(r));
  Derivative first = propagate_adjoints(loss);
  slope() = first(p)(0);
  Buffer<float> second = propagate_adjoints(slope)(p).realize({1});
  EXPECT_NEAR(second(0), many * 0.1f * 0.1f, many * 0.01 * 1e-6);
}

// b_adj(y) += seed(x, y) / s(y): the division is the same for all terms of a row.
TEST(LongSums, LeaveFactorsOfABlockToItsSum) {
  constexpr int width = 200'000, height = 5;
  Var x("x"), y("y");
  Func out("out"), seed("seed");
  Buffer<float> image(width, height), s(height), b(height);
  image.fill(1);
  b.fill(2);
  for (int i = 0; i < height; ++i) s(i) = static_cast<float>(i);  // the first is 0
  out(x, y) = (image(x, y) + b(y)) / s(y);
  seed(x, y) = select(y == 0, 0.0f, cast<float>(x % 3) - 0.5f);
  const Derivative d = propagate_adjoints(out, seed, {{0, width}, {0, height}});
  int blocks = 0;
  for (const graph::FuncPtr& f : graph::topological_order({d(b).function()})) {
    if (!f->made || f->made->blocks == 0) continue;
    ++blocks;
    for (const Expr& value : f->updates[0].values)
      EXPECT_FALSE(
          ir::any_node(value, [](const ir::Call& call) { return call.is_op(ir::Op::strong_div); }));
  }
  EXPECT_EQ(blocks, 1);
  const Buffer<float> found = d(b).realize({height});
  double sum = 0;
  for (int i = 0; i < width; ++i) sum += i % 3 - 0.5;
  EXPECT_EQ(found(0), 0) << "a strong zero";
  for (int i = 1; i < height; ++i) EXPECT_NEAR(found(i), sum / i, 1e-6 * 2 * width);
}

}  // namespace
}  // namespace retrograde
