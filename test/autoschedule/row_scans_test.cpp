// Scans along rows, as the autoscheduler runs them, forward and in gradients: results against the interpreter and on
// several threads.
#include <gtest/gtest.h>

#include "driver/schedule.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/definitions/own_reads.h"
#include "graph/names.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {
namespace {

using gradient::random_image;

struct RowScans : ::testing::Test {
  void set_signals(int samples, int count) {
    signals = random_image({samples, count}, -1, 1, 3);
    region = {{0, 0}, {samples, count}};
  }
  // A recursive filter of second order along each row.
  void filter(int samples, int count) {
    set_signals(samples, count);
    f(x, y) = signals(x, y);
    RDom r(2, std::max(samples - 2, 0), "r");
    f(r, y) = f(r, y) - coefficients(Expr(0)) * f(r - 1, y) - coefficients(Expr(1)) * f(r - 2, y);
  }
  // A gate, whose function of the element before is costly.
  void gate(int samples, int count) {
    set_signals(samples, count);
    f(x, y) = signals(x, y);
    RDom r(1, samples - 1, "r");
    f(r, y) = tanh(signals(r, y) + coefficients(Expr(0)) * f(r - 1, y));
  }
  void schedule() {
    f.bound(x, 0, region.extents[0]).bound(y, 0, region.extents[1]);
    Pipeline(f).auto_schedule(get_host_target());
  }

  void expect_results() {
    const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                       .realize(f.function(), region)
                                       .front();
    schedule();
    const Buffer<float> first = gradient::run_on_threads(f, region, 1, false);
    const auto comparison =
        oracle::compare(expected, *const_cast<Buffer<float>&>(first).raw_buffer(), 16);
    EXPECT_TRUE(comparison.agrees()) << comparison.first_mismatch << "\n" << f.loop_nest();
    for (const int threads : {2, 5}) {
      for (const bool backward : {false, true})
        EXPECT_TRUE(
            gradient::same_bits(first, gradient::run_on_threads(f, region, threads, backward)));
    }
  }

  Var x{"x"}, y{"y"};
  Func f{"f"};
  oracle::Region region;
  Buffer<float> signals, coefficients = [] {
    Buffer<float> values(2);
    values(0) = -0.75f;
    values(1) = 0.25f;
    return values;
  }();
};

TEST_F(RowScans, StartInTheirBlocksOfRows) {
  filter(100, 64);
  schedule();
  EXPECT_EQ(f.function()->updates[0].schedule.fuse_level.var, "y");
}

TEST_F(RowScans, AreEqualToTheInterpreter) {
  for (const int rows : {1, 3, 7, 17, 64}) {
    SCOPED_TRACE(rows);
    f = Func("f");
    filter(37, rows);
    expect_results();
  }
}

TEST_F(RowScans, InVectorsAreEqualToTheInterpreter) {
  for (const int rows : {1, 3, 7, 17, 64}) {
    SCOPED_TRACE(rows);
    f = Func("f");
    gate(19, rows);
    expect_results();
  }
}

TEST_F(RowScans, OfFewSamplesAreEqualToTheInterpreter) {
  for (const int samples : {2, 3, 4, 5}) {
    SCOPED_TRACE(samples);
    f = Func("f");
    filter(samples, 9);
    expect_results();
  }
}

// The number of rows is known at run time only.
TEST_F(RowScans, OfUnknownSizeAreEqualToTheInterpreter) {
  for (const int rows : {0, 1, 5, 8, 13}) {
    SCOPED_TRACE(rows);
    filter(21, 16);
    region.extents[1] = rows;
    const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                       .realize(f.function(), region)
                                       .front();
    Pipeline(f).auto_schedule(get_host_target());
    const Buffer<float> found = gradient::run_on_threads(f, region, 2, false);
    const auto comparison =
        oracle::compare(expected, *const_cast<Buffer<float>&>(found).raw_buffer(), 16);
    EXPECT_TRUE(comparison.agrees()) << comparison.first_mismatch;
    f = Func("f");
  }
}

// Rows that a reduction variable numbers.
TEST_F(RowScans, OverAllOfAnImage) {
  for (const int rows : {3, 17, 64}) {
    SCOPED_TRACE(rows);
    f = Func("f");
    set_signals(40, rows);
    f(x, y) = signals(x, y);
    RDom r(2, 38, 0, rows, "r");
    f(r.x, r.y) = f(r.x, r.y) + 0.5f * f(r.x - 1, r.y) - 0.25f * f(r.x - 2, r.y);
    expect_results();
    if (rows == 64) {
    }
  }
}

// Dynamic programming over a square: both loops run inside of those over pairs.
TEST_F(RowScans, InTwoDimensions) {
  Var n{"n"};
  Func g("g");
  signals = random_image({12, 20}, -1, 1, 3);
  Buffer<float> others = random_image({12, 20}, -1, 1, 4);
  g(x, y, n) = select(x == 0 && y == 0, 0.0f, 100.0f);
  RDom r(1, 12, 1, 12, "r");
  const Expr a = g(r.x - 1, r.y - 1, n), b = g(r.x - 1, r.y, n), c = g(r.x, r.y - 1, n);
  g(r.x, r.y, n) = abs(signals(r.x - 1, n) - others(r.y - 1, n)) -
                   0.5f * log(exp(-2 * a) + exp(-2 * b) + exp(-2 * c));
  f(x, y) = g(12, x, y);
  set_signals(13, 20);
  signals = random_image({12, 20}, -1, 1, 3);
  expect_results();
}

TEST_F(RowScans, HaveTheGradientsOfTheSignals) {
  for (const int rows : {1, 3, 9}) {
    f = Func("f");
    filter(20, rows);
    gradient::expect_gradient(gradient::weighted_sum(f, {20, rows}), signals);
  }
}

TEST_F(RowScans, HaveTheGradientsOfTheCoefficients) {
  for (const int rows : {1, 3, 9}) {
    f = Func("f");
    filter(70, rows);
    gradient::expect_gradient(gradient::weighted_sum(f, {70, rows}), coefficients);
  }
}

// Only the first two elements of a row get a term from elements before the recurrence: loops over rows keep it in a border.
TEST_F(RowScans, HaveBorderTermsThatAreNotLikely) {
  filter(100, 64);
  const Derivative d = propagate_adjoints(gradient::weighted_sum(f, {100, 64}));
  int borders = 0;
  for (const Func& g : d.funcs()) {
    if (g.name().find("adj_before_update0") == std::string::npos) continue;
    ir::walk(g.value(), [&](const Expr& e) {
      const auto* choice = e.as<ir::Select>();
      const std::string condition = choice ? ir::print(choice->condition) : "";
      if (condition.find("x < 2") == std::string::npos) return true;
      ++borders;
      EXPECT_EQ(condition.find("likely"), std::string::npos) << condition;
      return true;
    });
  }
  EXPECT_EQ(borders, 1);
}

// The terms are split into lanes along the rows of what they read.
TEST_F(RowScans, SumGradientsOfCoefficientsAlongRows) {
  filter(4096, 64);
  const Derivative d =
      propagate_adjoints(gradient::weighted_sum(f, {4096, 64}), {.wrt = {coefficients}});
  bool is_found = false;
  for (const Func& g : d.funcs()) {
    const graph::FuncContents& made = *g.function();
    if (made.made->lanes == 0) continue;
    for (const Expr& value : made.updates.at(0).values) {
      ir::walk(value, [&](const Expr& e) {
        const auto* call = e.as<ir::Call>();
        if (!call || !graph::is_call_of(*call, f.function().get())) return true;
        is_found = true;
        EXPECT_TRUE(ir::uses_variable(call->args[0], made.args[0])) << e;
        EXPECT_FALSE(ir::uses_variable(call->args[1], made.args[0])) << e;
        return true;
      });
    }
  }
  EXPECT_TRUE(is_found) << d.explain(Detail::All);
}

}  // namespace
}  // namespace retrograde
