// Reductions along rows, as the autoscheduler runs them: results are those of the declared order or closer to the exact
// ones, with the same bits on any number of threads.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <functional>

#include "gradient/gradient_check.h"
#include "graph/graph.h"
#include "support/variables.h"

namespace retrograde {
namespace {

constexpr int rows = 37;

Buffer<float> matrix(int width, int height = rows) {
  return gradient::random_image({width, height}, -1, 2, 5);
}

Func scheduled(Func f) {
  Pipeline(f).auto_schedule(get_host_target());
  return f;
}

using Reduce = std::function<void(Func&, const RDom&, const Expr& term)>;

void sum_up(Func& f, const RDom&, const Expr& term) {
  f(y) = 0.0f;
  f(y) += term;
}
void subtract(Func& f, const RDom&, const Expr& term) {
  f(y) = 1.0f;
  f(y) -= term;
}
void find_maximum(Func& f, const RDom&, const Expr& term) {
  f(y) = Float(32).min();
  f(y) = max(f(y), term);
}
void find_minimum(Func& f, const RDom&, const Expr& term) {
  f(y) = Float(32).max();
  f(y) = min(term, f(y));
}
void multiply(Func& f, const RDom&, const Expr& term) {
  f(y) = 1.0f;
  f(y) *= 1.0f + 0.01f * term;
}

Func reduction(const Reduce& reduce, int width) {
  Func f("f");
  const Buffer<float> in = matrix(width);
  const RDom r(0, width, "r");
  reduce(f, r, in(r, y) * in(r, y));
  f.bound(y, 0, rows);
  return f;
}

TEST(RowReductions, HaveTheResultsOfTheDeclaredOrder) {
  for (const auto& reduce : {sum_up, subtract, find_maximum, find_minimum, multiply}) {
    for (const int width : {64, 100, 1000}) {
      const Func f = scheduled(reduction(reduce, width));
      const Buffer<float> found = Func(f).realize({rows});
      const Buffer<float> expected = reduction(reduce, width).realize({rows});
      for (int i = 0; i < rows; ++i)
        EXPECT_NEAR(found(i), expected(i), 1e-5 * std::abs(expected(i))) << i << " of " << width;
    }
  }
}

TEST(RowReductions, HaveTheSameBitsOnAnyNumberOfThreads) {
  Pipeline pipeline(reduction(sum_up, 5000));
  pipeline.auto_schedule(get_host_target());
  pipeline.jit_handlers().thread_limit = 1;
  const Buffer<float> one = pipeline.realize({rows});
  for (const int threads : {2, 4}) {
    pipeline.jit_handlers().thread_limit = threads;
    const Buffer<float> more = pipeline.realize({rows});
    EXPECT_TRUE(gradient::same_bits(one, more)) << threads;
  }
}

TEST(RowReductions, StopWhereAPredicateDoes) {
  const auto triangle = [] {
    Func f("f");
    RDom r(0, 200, "r");
    r.where(r <= 5 * y);
    f(y) = 0.0f;
    f(y) += matrix(200)(r, y);
    f.bound(y, 0, rows);
    return f;
  };
  const Func f = scheduled(triangle());
  const Buffer<float> found = Func(f).realize({rows}), expected = triangle().realize({rows});
  for (int i = 0; i < rows; ++i) EXPECT_NEAR(found(i), expected(i), 1e-4) << i;
}

// Float32 sums of 131,072 equal terms lose three digits in their declared order.
TEST(RowReductions, KeepTheDigitsOfLongSums) {
  constexpr int terms = 1 << 17, few = 37;
  const double exact = 0.1f * static_cast<double>(terms);
  for (const bool along_rows : {true, false}) {
    Buffer<float> in = along_rows ? Buffer<float>(terms, few) : Buffer<float>(few, terms);
    in.fill(0.1f);
    Func f("f");
    const RDom r(0, terms, "r");
    f(y) = 0.0f;
    f(y) += along_rows ? in(r, y) : in(y, r);
    f.bound(y, 0, few);
    const Buffer<float> found = scheduled(f).realize({few});
    for (int i = 0; i < few; ++i) EXPECT_NEAR(found(i), exact, 5e-6 * exact) << i << along_rows;
  }
}

// Neither rows nor their number are multiples of blocks.
TEST(RowReductions, AddAllTermsOfBlocks) {
  constexpr int width = 4099, height = 67, few = 21;
  const auto sum = [&](bool along_rows) {
    const Buffer<float> in = gradient::random_image(
        along_rows ? std::vector<int>{width, height, few} : std::vector<int>{few, width, height},
        -1, 2, 3);
    Func f("f");
    const RDom r(0, width, 0, height, "r");
    f(y) = 0.0f;
    f(y) += along_rows ? in(r.x, r.y, y) : in(y, r.x, r.y);
    f.bound(y, 0, few);
    return f;
  };
  for (const bool along_rows : {true, false}) {
    const Buffer<float> found = scheduled(sum(along_rows)).realize({few});
    const Buffer<float> expected = sum(along_rows).realize({few});
    for (int i = 0; i < few; ++i)
      EXPECT_NEAR(found(i), expected(i), 1e-4 * std::abs(expected(i))) << i << along_rows;
  }
}

TEST(RowReductions, RunOverPlanesOfSeveralDimensions) {
  const auto mean = [] {
    Buffer<float> in = gradient::random_image({32, 20, 8, 3}, -1, 2, 7);
    Func f("f");
    const RDom r(0, 32, 0, 20, "r");
    f(y, z) = 0.0f;
    f(y, z) += in(r.x, r.y, y, z) / 640.0f;
    f.bound(y, 0, 8).bound(z, 0, 3);
    return f;
  };
  const Func f = scheduled(mean());
  const Buffer<float> found = Func(f).realize({8, 3}), expected = mean().realize({8, 3});
  expected.for_each_element([&](const int* at) { EXPECT_NEAR(found(at), expected(at), 1e-5); });
}

// ---- extremes and their places ----

// The sum of the largest or smallest element of each row, of which many are equal.
struct Extremes {
  Extremes(bool is_largest, bool is_old_first) {
    in = Buffer<float>(width, rows);
    in.get()->for_each_value(
        [&, n = 0](float& v) mutable { v = static_cast<float>(n++ * 7 % 11); });
    const RDom r(0, width, "r");
    const RDom row(0, rows, "row");
    Func extreme("extreme");
    const Expr term = in(r, y);
    extreme(y) = is_largest ? Float(32).min() : Float(32).max();
    const Expr old = extreme(y), a = is_old_first ? old : term, b = is_old_first ? term : old;
    extreme(y) = is_largest ? max(a, b) : min(a, b);
    loss() = 0.0f;
    loss() += extreme(row) * cast<float>(row + 1);
    gradient = propagate_adjoints(loss)(in);
  }
  static constexpr int width = 1000;
  Buffer<float> in;
  Func loss{"loss"}, gradient;
};

TEST(RowReductions, FindTheFirstOrLastOfEqualExtremes) {
  for (const bool is_largest : {false, true}) {
    for (const bool is_old_first : {false, true}) {
      Extremes program(is_largest, is_old_first);
      Pipeline pipeline(program.gradient);
      const Buffer<float> found = pipeline.realize({Extremes::width, rows});
      const oracle::Array expected =
          gradient::evaluate(program.gradient, {{0, 0}, {Extremes::width, rows}});
      found.for_each_element([&](const int* at) {
        EXPECT_EQ(found(at), expected.at({at[0], at[1]}).scalar.as_double())
            << at[0] << ", " << at[1];
      });
    }
  }
}

// ---- the backward pass ----

// The mean cross entropy of rows of logits.
struct CrossEntropy {
  CrossEntropy() {
    logits = matrix(classes);
    labels = Buffer<int>(rows);
    labels.get()->for_each_value([&, n = 0](int& v) mutable { v = n++ * 7 % classes; });
    const RDom r(0, classes, "r"), row(0, rows, "row");
    Func largest("largest"), total("total");
    largest(y) = maximum(logits(r, y));
    total(y) = 0.0f;
    total(y) += exp(logits(r, y) - largest(y));
    loss() = 0.0f;
    loss() += log(total(row)) + largest(row) - logits(clamp(labels(row), 0, classes - 1), row);
  }
  static constexpr int classes = 100;
  Buffer<float> logits;
  Buffer<int> labels;
  Func loss{"loss"};
};

// Each element of a row compares its place with the label: nothing scatters, and nothing is summed in double.
TEST(RowReductions, SelectTheElementOfARowThatDataDecide) {
  const CrossEntropy program;
  const Func gradient = propagate_adjoints(program.loss)(program.logits);
  EXPECT_TRUE(gradient.function()->is_pure());
  const Buffer<float> found = Pipeline(gradient).realize({CrossEntropy::classes, rows});
  const oracle::Array expected =
      gradient::evaluate(gradient, {{0, 0}, {CrossEntropy::classes, rows}});
  found.for_each_element([&](const int* at) {
    EXPECT_NEAR(found(at), expected.at({at[0], at[1]}).scalar.as_double(), 1e-6);
  });
  Buffer<float> logits = program.logits;
  for (const std::vector<int>& at : std::vector<std::vector<int>>{{0, 0}, {7, 1}, {8, 1}, {14, 2}})
    EXPECT_NEAR(found(at[0], at[1]), gradient::difference(program.loss, logits, at), 1e-3);
}

}  // namespace
}  // namespace retrograde
