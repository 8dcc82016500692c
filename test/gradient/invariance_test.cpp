// Tests the detection of Funcs whose contributions cancel: exactly these have the adjoint 0, with the reason in
// explain(). Forward mode, which follows every path, gives the expected gradients.
#include "autodiff/rules/invariance.h"

#include "autodiff/tangents.h"
#include "gradient/gradient_check.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

class Invariance : public ::testing::Test {
 protected:
  static constexpr int n = 5, rows = 3;
  Var x{"x"}, y{"y"};
  RDom r{0, n};
  Buffer<float> a = random_image({n, rows}, -2, 2, 7), w = random_image({n, rows}, -2, 2, 8);
  Func m{"m"}, e{"e"}, s{"s"}, p{"p"};

  Invariance() { m(y) = maximum(r, a(r, y)); }
  void softmax(const Expr& exponential) {
    e(x, y) = exponential;
    s(y) += e(r, y);
    p(x, y) = e(x, y) / s(y);
  }
  // A weighted loss, so that no symmetry hides a wrong gradient.
  Func loss_of(const Func& f, const Expr& extra = 0.0f) {
    Func loss("loss");
    RDom q(0, n, 0, rows);
    loss() = extra;
    loss() += f(q.x, q.y) * w(q.x, q.y) + 0.5f * f(q.x, q.y) * f(q.x, q.y);
    return loss;
  }
  static bool cancels(const Func& m, const Func& loss) {
    return autodiff::cancelling_funcs(graph::topological_order({loss.function()}),
                                      {loss.function()})
        .contains(m.function().get());
  }
  // Checks the gradient in double.
  void expect_right(const Func& loss) {
    oracle::Array gradient = evaluate(propagate_adjoints(loss)(a), {{0, 0}, {n, rows}});
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < n; ++i) {
        Buffer<float> unit(n, rows);
        unit.fill(0);
        unit(i, j) = 1;
        EXPECT_NEAR(gradient.at({i, j}).scalar.as_double(),
                    evaluate_scalar(propagate_tangents(loss, {{a, unit}})(loss)), 1e-11);
      }
    }
  }
  void expect_cancels(const Func& f) {
    Func loss = loss_of(f);
    EXPECT_TRUE(cancels(m, loss));
    expect_right(loss);
  }
  void expect_counts(const Func& loss) {
    EXPECT_FALSE(cancels(m, loss));
    expect_right(loss);
  }
};

TEST_F(Invariance, OfSoftmaxShiftedByTheMaximum) {
  softmax(exp(a(x, y) - m(y)));
  expect_cancels(p);
  Buffer<float> zero = propagate_adjoints(loss_of(p))(m).realize({rows});
  for (int j = 0; j < rows; ++j) EXPECT_EQ(zero(j), 0);
  expect_fact(propagate_adjoints(loss_of(p)).explanations(), Fact::Zero, m.name(),
              "the output is the same for all of its values: it only shifts or scales a softmax, a "
              "log-sum-exp or a norm, which cancels");
}

TEST_F(Invariance, OfSoftmaxWithATemperatureAndInAnotherBase) {
  softmax(pow(2.0f, 3.0f * (a(x, y) - m(y)) / 2.0f));
  expect_cancels(p);
}

TEST_F(Invariance, OfTheLogarithmOfSoftmax) {
  Func shifted("shifted"), f("f");
  shifted(x, y) = a(x, y) - m(y);
  s(y) += exp(shifted(r, y));
  f(x, y) = shifted(x, y) - log(s(y));
  expect_cancels(f);
}

TEST_F(Invariance, OfLogSumExp) {
  Func f("f");
  s(y) += exp(a(r, y) - m(y));
  f(x, y) = m(y) + log(s(y));
  expect_cancels(f);
}

TEST_F(Invariance, OfNormsScaledByTheMaximum) {
  Func f("f");
  m(y) = 0.5f;
  m(y) = max(m(y), abs(a(r, y)));
  s(y) += pow(a(r, y) / m(y), 2);
  f(x, y) = m(y) * sqrt(s(y));
  expect_cancels(f);
}

TEST_F(Invariance, OfSoftmaxWithAMask) {
  Buffer<uint8_t> mask(n, rows);
  mask.fill(1);
  mask(2, 1) = 0;
  softmax(select(mask(x, y) != 0, exp(a(x, y) - m(y)), 0.0f));
  expect_cancels(p);
}

TEST_F(Invariance, OfAGradientOfSoftmax) {
  softmax(exp(a(x, y) - m(y)));
  Func gradient = propagate_adjoints(loss_of(p))(a);
  Func loss = loss_of(gradient);
  EXPECT_TRUE(cancels(m, loss));
  expect_right(loss);
}

TEST_F(Invariance, NotWhereItIsUsedElsewhere) {
  softmax(exp(a(x, y) - m(y)));
  expect_counts(loss_of(p, m(1)));
  expect_counts(loss_of(e));
}

TEST_F(Invariance, NotOfAnotherRow) {
  e(x, y) = exp(a(x, y) - m(y));
  s(y) += e(r, y);
  p(x, y) = e(x, y) / s((y + 1) % rows);
  expect_counts(loss_of(p));
}

TEST_F(Invariance, NotWhereASumGoesOverDifferentShifts) {
  RDom all(0, n, 0, rows);
  e(x, y) = exp(a(x, y) - m(y));
  s() += e(all.x, all.y);
  p(x, y) = e(x, y) / s();
  expect_counts(loss_of(p));
}

TEST_F(Invariance, NotWhereAConstantIsAddedToTheSum) {
  e(x, y) = exp(a(x, y) - m(y));
  s(y) = 1.0f;
  s(y) += e(r, y);
  p(x, y) = e(x, y) / s(y);
  expect_counts(loss_of(p));
}

TEST_F(Invariance, NotOfADifferentDegree) {
  e(x, y) = exp(a(x, y) - m(y));
  s(y) += e(r, y) * e(r, y);
  p(x, y) = e(x, y) / s(y);
  expect_counts(loss_of(p));
  Func root("root");
  root(x, y) = e(x, y) / sqrt(s(y));
  expect_cancels(root);
}

TEST_F(Invariance, NotPastAStoppedGradient) {
  e(x, y) = exp(a(x, y) - m(y));
  s(y) += exp(a(r, y) - stop_gradient(m(y)));
  p(x, y) = e(x, y) / s(y);
  expect_counts(loss_of(p));
}

TEST_F(Invariance, NotOfAMeanThatIsSubtracted) {
  Func mean("mean"), f("f");
  mean(y) += a(r, y) / float(n);
  f(x, y) = (a(x, y) - mean(y)) * (a(x, y) - mean(y));
  EXPECT_FALSE(cancels(mean, loss_of(f)));
  expect_right(loss_of(f));
}

// Random expressions over terms that shift and terms that scale: every gradient agrees with the tangents, and some
// programs cancel.
class RandomInvariance : public Invariance {
 protected:
  std::mt19937 random{2026};
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); }
  Expr leaf() {
    const std::vector<Expr> leaves = {e(x, y), s(y), e(x, y),          s(y), m(y), a(x, y),
                                      2.0f,    0.0f, s((y + 1) % rows)};
    return leaves[static_cast<size_t>(below(static_cast<int>(leaves.size())))];
  }
  Expr expression(int depth) {
    if (depth == 0) return leaf();
    const Expr u = expression(depth - 1), v = expression(below(depth));
    switch (below(9)) {
      case 0:
        return u + v;
      case 1:
        return u - v;
      case 2:
        return u * v;
      case 3:
      case 4:
        return u / v;
      case 5:
        return max(u, v);
      case 6:
        return log(abs(u)) + v;
      case 7:
        return exp(0.5f * u) * v;
      default:
        return sqrt(abs(u));
    }
  }
};

TEST_F(RandomInvariance, AgreesWithTangents) {
  e(x, y) = exp(a(x, y) - m(y));
  s(y) += e(r, y);
  int checked = 0, cancelling = 0;
  for (int program = 0; program < 250; ++program) {
    Func f("f");
    f(x, y) = expression(1 + below(3));
    Func loss = loss_of(f);
    const double along = evaluate_scalar(propagate_tangents(loss, {{a, w}})(loss));
    if (!std::isfinite(along) || !std::isfinite(evaluate_scalar(loss))) continue;
    Func adjoint = propagate_adjoints(loss, {.wrt = {a}})(a);  // some do not depend on it
    oracle::Array gradient = evaluate(adjoint, {{0, 0}, {n, rows}});
    double sum = 0, size = 0;
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < n; ++i) {
        sum += gradient.at({i, j}).scalar.as_double() * w(i, j);
        size += std::abs(gradient.at({i, j}).scalar.as_double() * w(i, j));
      }
    }
    EXPECT_NEAR(sum, along, 1e-9 * (size + 1)) << ir::print(f.value());
    ++checked;
    cancelling += cancels(m, loss);
  }
  EXPECT_GT(checked, 120);
  EXPECT_GT(cancelling, 3);
}

}  // namespace
}  // namespace retrograde::gradient
