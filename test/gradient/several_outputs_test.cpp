// Tests one backward pass from several outputs: its gradients are those of the sum of all outputs, weighted by their
// adjoints, and what the outputs have in common is differentiated once.
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

class SeveralOutputs : public ::testing::Test {
 protected:
  static constexpr int n = 7;
  Var x{"x"};
  Buffer<float> a = random_image({n}, -1, 1, 3), w = random_image({3}, -1, 1, 4);

  // An output over [0, size), with an adjoint that differs between outputs and elements.
  void add(const Func& output, int size = n) {
    const float first = 0.5f * static_cast<float>(outputs_.size() + 1);
    Func adjoint("adjoint");
    adjoint(x) = first - 0.25f * cast<float>(x);
    outputs_.push_back({.output = output, .adjoint = adjoint, .output_bounds = {{0, size}}});
    RDom r(0, size);
    weighted_() += output(r) * adjoint(r);
  }
  Derivative derived(const AdjointOptions& options = {}) const {
    return propagate_adjoints(outputs_, options);
  }
  void expect_right(const AdjointOptions& options = {}) {
    const Derivative d = derived(options);
    expect_gradient(weighted_, d, a);
    expect_gradient(weighted_, d, w);
  }
  Func filtered() const {
    Func f("filtered");
    f(x) = 0.0f;
    RDom r(0, 3);
    f(x) += w(r) * a(clamp(x + r - 1, 0, n - 1));
    return f;
  }

  std::vector<OutputAdjoint> outputs_;
  Func weighted_{"weighted"};
};

TEST_F(SeveralOutputs, ShareTheirProgram) {
  Func common = filtered(), sine("sine"), square("square"), shifted("shifted");
  sine(x) = sin(common(x));
  square(x) = common(x) * common(x);
  shifted(x) = exp(common(x + 2) - common(x));
  add(sine);
  add(square, n - 2);
  add(shifted, n - 2);
  expect_right();
  double apart = 0;
  for (const OutputAdjoint& one : outputs_)
    apart += *propagate_adjoints({one}).operations().gradient.operations().value();
  const double together = *derived().operations().gradient.operations().value();
  EXPECT_LT(together, 0.75 * apart);
}

TEST_F(SeveralOutputs, MayReadEachOther) {
  Func first = filtered(), second("second");
  second(x) = first(x) * first(x + 3);
  add(first, n - 2);
  add(second, n - 3);
  expect_right();
}

TEST_F(SeveralOutputs, MayOccurTwice) {
  Func f("cubes");
  f(x) = a(x) * a(x) * a(x) * w(0);
  add(f, 3);
  add(f);
  expect_right();
}

TEST_F(SeveralOutputs, CountAFuncThatCancelsInOneOfThem) {
  Func largest("largest"), sum("sum"), share("share"), level("level");
  RDom r(0, n);
  largest() = maximum(r, a(r) * w(0));
  sum() += exp(a(r) * w(0) - largest());
  share(x) = exp(a(x) * w(0) - largest()) / sum();
  level(x) = largest() * w(1);
  const auto has_zero = [&] {
    return !details_of(derived().explanations(), Fact::Zero, largest.name()).empty();
  };
  add(share);
  EXPECT_TRUE(has_zero());
  add(level, 1);
  EXPECT_FALSE(has_zero());
  expect_right();
}

TEST_F(SeveralOutputs, OfAChangedFuncAndOfItsConsumer) {
  Func scan("scan"), smooth("smooth");
  RDom r(1, n - 1);
  scan(x) = a(x);
  scan(r) = scan(r) + w(0) * sin(scan(r - 1));
  smooth(x) = scan(x) * w(1) + scan(x + 1) * w(2);
  add(scan);
  add(smooth, n - 1);
  expect_right();
}

TEST_F(SeveralOutputs, OfALoopOverTimeWithCheckpoints) {
  Func state("state"), end("end"), energy("energy");
  Var t("t");
  RDom r(0, 9);
  state(x, t) = a(x);
  state(x, r + 1) = state(x, r) + 0.25f * w(0) * sin(state(x, r));
  end(x) = state(x, 9);
  energy(x) = end(x) * end(x) * w(1) + state(x, 9) * w(2);
  add(end);
  add(energy, n - 1);
  expect_right({.checkpoint_states = 3});
  EXPECT_FALSE(derived({.checkpoint_states = 3}).has(state));  // overwrites its steps
}

TEST_F(SeveralOutputs, AreNamedInTheReport) {
  Func common = filtered(), sine("sine"), square("square");
  sine(x) = sin(common(x));
  square(x) = common(x) * common(x);
  add(sine);
  add(square);
  EXPECT_EQ(derived().costs().back().subject, sine.name() + ", " + square.name());
}

TEST_F(SeveralOutputs, AreAtLeastOne) {
  expect_error({"there is at least one output"}, [&] { derived(); });
}

TEST_F(SeveralOutputs, HaveAdjointsOfTheirShape) {
  Func f = filtered(), flat("flat");
  flat() = 1.0f;
  add(f);
  outputs_.push_back({f, flat, {{0, n}}});
  expect_error({"an adjoint has the dimensions of its Func"}, [&] { derived(); });
}

}  // namespace
}  // namespace retrograde::gradient
