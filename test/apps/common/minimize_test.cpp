// Tests the optimizers of the apps: they find minima, obey their limits, keep the best point, and survive points at
// which the loss is NaN.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "common/checks.h"
#include "common/minimize.h"
#include "common/stop.h"
#include "diagnostics/error.h"

namespace {

using apps::Method;
using Numbers = std::span<const double>;

const std::vector<double> rosenbrock_start{-1.2, 1, -1.2, 1};

// The function of H. Rosenbrock, Computer Journal 3 (1960), in pairs of variables: a bent valley with its minimum at
// ones.
apps::Problem rosenbrock() {
  apps::Problem problem{.size = 4};
  problem.evaluate = [](Numbers x, std::span<double> gradient) {
    double loss = 0;
    for (size_t n = 0; n < x.size(); n += 2) {
      const double bend = x[n + 1] - x[n] * x[n], rest = 1 - x[n];
      loss += 100 * bend * bend + rest * rest;
      if (gradient.empty()) continue;
      gradient[n] = -400 * bend * x[n] - 2 * rest;
      gradient[n + 1] = 200 * bend;
    }
    return loss;
  };
  problem.hessian_product = [](Numbers x, Numbers v, std::span<double> product) {
    for (size_t n = 0; n < x.size(); n += 2) {
      product[n] = (1200 * x[n] * x[n] - 400 * x[n + 1] + 2) * v[n] - 400 * x[n] * v[n + 1];
      product[n + 1] = -400 * x[n] * v[n] + 200 * v[n + 1];
    }
  };
  return problem;
}

// x - log x, which is NaN for x <= 0 and has its minimum at 1.
apps::Problem with_a_wall() {
  apps::Problem problem{.size = 1};
  problem.evaluate = [](Numbers x, std::span<double> gradient) {
    if (!gradient.empty()) gradient[0] = x[0] > 0 ? 1 - 1 / x[0] : NAN;
    return x[0] - std::log(x[0]);
  };
  problem.hessian_product = [](Numbers x, Numbers v, std::span<double> product) {
    product[0] = v[0] / (x[0] * x[0]);
  };
  return problem;
}

class EveryMethod : public testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(AppMinimize, EveryMethod,
                         testing::Values(Method::Adam, Method::Lbfgs, Method::ConjugateGradient,
                                         Method::NewtonCg),
                         [](const auto& info) { return apps::name_of(info.param); });

TEST_P(EveryMethod, FindsTheEndOfABentValley) {
  const auto found = apps::minimize(rosenbrock(), rosenbrock_start,
                                    {.method = GetParam(), .steps = 6000, .rate = 0.02});
  EXPECT_LT(found.loss, 1e-6) << found.ended;
  for (const double x : found.x) EXPECT_NEAR(x, 1, 1e-2);
  EXPECT_EQ(found.series.size(), static_cast<size_t>(found.steps) + 1);
  EXPECT_DOUBLE_EQ(found.series.front().loss, 48.4);
  EXPECT_FALSE(found.ended.empty());
  EXPECT_FALSE(found.stopped);
}

TEST_P(EveryMethod, TakesNoMoreStepsThanItMay) {
  const auto found =
      apps::minimize(rosenbrock(), rosenbrock_start, {.method = GetParam(), .steps = 3});
  EXPECT_EQ(found.steps, 3);
  EXPECT_EQ(found.ended, "all steps are done");
  EXPECT_LT(found.loss, found.series.front().loss);
}

TEST_P(EveryMethod, EndsWhenTheProgramSaysSo) {
  const auto found = apps::minimize(rosenbrock(), rosenbrock_start, {.method = GetParam()},
                                    [](const apps::LossSample& sample, Numbers best) {
                                      EXPECT_EQ(best.size(), 4u);
                                      return sample.step < 2;
                                    });
  EXPECT_EQ(found.steps, 2);
}

TEST_P(EveryMethod, EndsWhenItIsStopped) {
  const auto found = apps::minimize(rosenbrock(), rosenbrock_start, {.method = GetParam()},
                                    [](const apps::LossSample& sample, Numbers) {
                                      apps::request_stop(sample.step == 2);
                                      return true;
                                    });
  apps::request_stop(false);
  EXPECT_EQ(found.steps, 2);
  EXPECT_TRUE(found.stopped);
  EXPECT_EQ(found.ended, "it was stopped");
}

TEST_P(EveryMethod, EndsWhenItsTimeIsOver) {
  // A limit of one nanosecond has passed after the first step.
  const auto found = apps::minimize(rosenbrock(), rosenbrock_start,
                                    {.method = GetParam(), .steps = 100, .seconds = 1e-9});
  EXPECT_EQ(found.steps, 1);
  EXPECT_EQ(found.ended, "its time is over");
}

TEST_P(EveryMethod, ComesBackFromWhereTheLossIsNoNumber) {
  // At this rate, the first step of Adam jumps over the wall, as does that of any line search from such a steep point.
  const std::vector<double> start{3};
  const auto found =
      apps::minimize(with_a_wall(), start, {.method = GetParam(), .steps = 400, .rate = 8});
  EXPECT_NEAR(found.x[0], 1, 1e-3) << found.ended;
  EXPECT_TRUE(std::isfinite(found.loss));
  if (GetParam() == Method::Adam) {
    EXPECT_GT(found.refused, 0);
  }
}

TEST(AppMinimize, AStartWithoutALossIsRefused) {
  const std::vector<double> start{-1};
  try {
    apps::minimize(with_a_wall(), start, {});
    FAIL() << "began at a NaN";
  } catch (const retrograde::UserError& error) {
    EXPECT_NE(std::string(error.what()).find("must be finite there"), std::string::npos);
  }
}

TEST(AppMinimize, NewtonLeavesAPlaceOfNegativeCurvature) {
  apps::Problem problem{.size = 1};  // x^4 - x^2 near its top
  problem.evaluate = [](Numbers x, std::span<double> gradient) {
    if (!gradient.empty()) gradient[0] = 4 * std::pow(x[0], 3) - 2 * x[0];
    return std::pow(x[0], 4) - x[0] * x[0];
  };
  problem.hessian_product = [](Numbers x, Numbers v, std::span<double> product) {
    product[0] = (12 * x[0] * x[0] - 2) * v[0];
  };
  const std::vector<double> start{0.01};
  const auto found = apps::minimize(problem, start, {.method = Method::NewtonCg, .steps = 40});
  EXPECT_NEAR(found.x[0], std::sqrt(0.5), 1e-6);
  EXPECT_GT(found.products, 0);
}

TEST(AppMinimize, MethodsHaveNames) {
  EXPECT_EQ(apps::method_named("newton_cg"), Method::NewtonCg);
  EXPECT_THROW(apps::method_named("guessing"), retrograde::UserError);
}

TEST(AppAdam, TakesThePapersFirstStep) {
  // For any gradient, the first step is rate * g / (|g| + epsilon): algorithm 1 with t = 1.
  apps::Adam adam({{1, 0.1}, {1, 0.01}});
  std::vector<double> x{1, 1};
  EXPECT_TRUE(adam.step(x, 1.0, std::vector<double>{123, -5}));
  EXPECT_NEAR(x[0], 0.9, 1e-9);
  EXPECT_NEAR(x[1], 1.01, 1e-9);
}

TEST(AppAdam, TheRateFollowsItsSchedule) {
  apps::Adam adam({{1, 1.0}}, {.schedule = apps::exponential_schedule(11, 1e-2)});
  std::vector<float> x{0};
  EXPECT_DOUBLE_EQ(adam.rate_factor(), 1);
  for (int n = 0; n < 10; ++n) adam.step(x, 1.0, std::vector<float>{1});
  EXPECT_NEAR(adam.rate_factor(), 1e-2, 1e-12);
}

TEST(AppAdam, ARefusedStepIsTakenBackAndHalved) {
  apps::Adam adam({{1, 1.0}});
  std::vector<double> x{5};
  EXPECT_TRUE(adam.step(x, 1.0, std::vector<double>{1}));
  EXPECT_NEAR(x[0], 4, 1e-6);
  EXPECT_FALSE(adam.step(x, NAN, std::vector<double>{1}));
  EXPECT_EQ(x[0], 5);
  EXPECT_FALSE(adam.step(x, 1.0, std::vector<double>{INFINITY}));
  EXPECT_EQ(adam.refused(), 2);
  EXPECT_EQ(adam.rate_factor(), 0.25);
  EXPECT_TRUE(adam.step(x, 1.0, std::vector<double>{1}));
  EXPECT_GT(x[0], 4.5);
}

TEST(AppAdam, ALossThatExplodesIsRefusedWhereThatIsAskedFor) {
  apps::Adam adam({{1, 1.0}}, {.explosion = 100});
  std::vector<double> x{5};
  EXPECT_TRUE(adam.step(x, 2.0, std::vector<double>{1}));
  EXPECT_TRUE(adam.step(x, 199.0, std::vector<double>{1}));
  EXPECT_FALSE(adam.step(x, 201.0, std::vector<double>{1}));
  EXPECT_EQ(adam.refused(), 1);
}

// Negative losses arise from a logarithm, or from a negated quantity to be maximised.
TEST(AppAdam, LossesBelowZeroAreLossesLikeOthers) {
  for (const double explosion : {100.0, static_cast<double>(INFINITY)}) {
    apps::Adam adam({{1, 1.0}}, {.explosion = explosion});
    std::vector<double> x{5};
    for (const double loss : {2.0, 0.0, -3.0, -2.0, -40.0})
      EXPECT_TRUE(adam.step(x, loss, std::vector<double>{1})) << loss << " " << explosion;
    EXPECT_FALSE(adam.step(x, NAN, std::vector<double>{1}));
  }
}

TEST(AppAdam, WithoutSafeguardANaNStays) {
  apps::Adam adam({{1, 1.0}}, {.safeguard = false});
  std::vector<double> x{5};
  EXPECT_TRUE(adam.step(x, NAN, std::vector<double>{NAN}));
  EXPECT_TRUE(std::isnan(x[0]));
}

TEST(AppAdam, GoesOnFromAStateToTheBit) {
  const auto gradient = [](const std::vector<double>& x) {
    return std::vector<double>{2 * x[0], std::cos(x[1])};
  };
  apps::Adam whole({{2, 0.1}}), half({{2, 0.1}}), rest({{2, 0.1}});
  std::vector<double> x{1, 2}, y{1, 2};
  for (int n = 0; n < 20; ++n) whole.step(x, 0.0, gradient(x));
  for (int n = 0; n < 10; ++n) half.step(y, 0.0, gradient(y));
  apps::State state;
  half.save(state, "adam");
  rest.restore(state, "adam");
  for (int n = 0; n < 10; ++n) rest.step(y, 0.0, gradient(y));
  EXPECT_EQ(x, y);
  EXPECT_EQ(rest.steps(), 20);
}

TEST(AppChecks, ErrorsAreRelativeToTheLargest) {
  const std::vector<double> exact{100, 1, INFINITY}, own{101, 1.5, INFINITY};
  EXPECT_NEAR(apps::relative_error(own, exact), 0.01, 1e-12);
  const std::vector<double> lost{NAN, 1, 0};
  EXPECT_TRUE(std::isnan(apps::relative_error(lost, exact)));
  const std::vector<double> zeros{0, 0, 0};
  EXPECT_EQ(apps::relative_error(zeros, zeros), 0);
  const std::vector<double> rounding{1e-12, -1e-12, 0};
  EXPECT_NEAR(apps::relative_error(rounding, zeros, 1e-6), 1e-6, 1e-12);
}

TEST(AppChecks, DivergingIsNotComingBack) {
  std::vector<apps::LossSample> series{{0, 0, 1}, {1, 0, 50}, {2, 0, 2}, {3, 0, 99}, {4, 0, NAN}};
  EXPECT_EQ(apps::diverging_step(series), 3);
  series.resize(3);
  EXPECT_EQ(apps::diverging_step(series), std::nullopt);
}

TEST(AppChecks, SafeguardsKeepAdamFromDiverging) {
  apps::StabilityRow row{.name = "wall"};
  const std::vector<double> start{3};
  apps::measure_divergence(row, with_a_wall(), start,
                           {.method = Method::Adam, .steps = 50, .rate = 8});
  EXPECT_EQ(row.diverges_plain, 1);
  EXPECT_EQ(row.diverges_guarded, std::nullopt);
  EXPECT_NE(apps::stability_table({row}).to_markdown().find("| wall | 0 | 0 | 1 | never |"),
            std::string::npos);
}

TEST(AppChecks, AGradientBeyondItsLimitIsRefused) {
  apps::require_gradients({{"good", 1e-9, 1e-5}});
  EXPECT_THROW(apps::require_gradients({{"good", 1e-9, 1e-5}, {"wrong", 1e-3, 1e-5}}),
               retrograde::UserError);
  EXPECT_THROW(apps::require_gradients({{"rough", 1e-9, 1e-2}}), retrograde::UserError);
  EXPECT_THROW(apps::require_gradients({{"lost", NAN, 0}}), retrograde::UserError);
}

TEST(AppChecks, AReportOfTheLibraryBecomesATable) {
  retrograde::Buffer<float> weights(3);
  for (int n = 0; n < 3; ++n) weights(n) = 0.5f + static_cast<float>(n);
  retrograde::Func loss("loss");
  retrograde::RDom r(0, 3);
  loss() = 0.0f;
  loss() += retrograde::sin(weights(r)) * weights(r);
  const auto rows = apps::gradient_rows(retrograde::check_gradients(loss));
  ASSERT_EQ(rows.size(), 1u);
  apps::require_gradients(rows);
  EXPECT_EQ(apps::gradient_table(rows).rows.size(), 1u);
}

}  // namespace
