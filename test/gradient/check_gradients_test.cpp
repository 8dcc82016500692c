// Tests that check_gradients accepts right gradients and reports wrong ones. A wrong gradient is made with
// stop_gradient, whose derivative is not that of the values; lost digits by a cancellation.
#include <map>
#include <nlohmann/json.hpp>

#include "autodiff/custom_derivative.h"
#include "checks/check_gradients.h"
#include "diagnostics/pass_observer.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

namespace retrograde::gradient {
namespace {

class CheckGradients : public ::testing::Test {
 protected:
  Var x{"x"}, y{"y"};
  Buffer<float> a = random_image({12, 9}, 0.25, 2, 1);
  ImageParam image{Float(32), 2, "image"};
  Param<float> gain{"gain"};

  void SetUp() override {
    image.set(a);
    gain.set(1.25f);
  }
};

TEST_F(CheckGradients, ARightGradientHasSmallErrors) {
  Func blur("blur"), f("f"), loss("loss");
  RDom r(0, 3), all(0, 10, 0, 9);
  blur(x, y) = sum(image(x + r, y) * cast<float>(r + 1)) * gain;
  f(x, y) = tanh(blur(x, y) * 0.1f) + sqrt(image(x, y)) * exp(-blur(x, y));
  loss() += f(all.x, all.y) * f(all.x, all.y);
  GradientReport report = check_gradients(loss);
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
  ASSERT_EQ(report.inputs.size(), 2u);
  for (const auto& input : report.inputs) {
    EXPECT_LT(input.dot_product_error, 1e-12) << report.to_json();
    EXPECT_LT(input.own_precision_error, 1e-4) << report.to_json();
    EXPECT_LT(input.complex_step_error, 1e-12) << report.to_json();
    ASSERT_EQ(input.methods.size(), 5u);
    for (const auto& m : input.methods) EXPECT_GT(m.seconds, 0) << m.name;
    ASSERT_EQ(input.steps.size(), 11u);
    EXPECT_GT(input.steps.front().central_error, input.steps[4].central_error);
    EXPECT_GT(input.steps.front().seconds, 0);
  }
  EXPECT_GE(report.funcs.size(), 4u);
  EXPECT_EQ(report.complex_step_refused, "");
}

// Differences run the primal about seventy times. The schedule of a gradient may be chosen among three that are lowered.
TEST_F(CheckGradients, NothingIsCompiledTwice) {
  Func f("f"), loss("loss");
  RDom all(0, 12, 0, 9);
  f(x, y) = exp(image(x, y)) * gain;
  loss() += f(all.x, all.y) * f(all.x, all.y);
  std::map<std::string, int> compiled;
  {
    PassObserver observer([&](const PassReport& report) {
      if (report.pass == "build_loop_nests") ++compiled[report.pipeline];
    });
    check_gradients(loss, {}, {.wrt = {image}});
  }
  EXPECT_GE(compiled.size(), 5u);
  compiled.erase("chosen");  // schedules that auto_schedule() compares
  for (const auto& [pipeline, times] : compiled) EXPECT_LE(times, 3) << pipeline;
}

// Every operator that has a complex form, and both kinds of stages.
TEST_F(CheckGradients, TheComplexStepIsExactWhereItIsAllowed) {
  Func f("f"), g("g"), loss("loss");
  RDom r(1, 11), all(0, 12, 0, 9);
  Expr u = image(x, y), w = image(11 - x, y);
  f(x, y) = exp(u * 0.3f) * log(w + 1.0f) + sqrt(u * u + w) + pow(u, 1.5f) + pow(u, w) +
            sin(u) * cos(w) + tan(u * 0.25f) + sinh(u * 0.5f) - cosh(w * 0.5f) + tanh(u - w) +
            hypot(u, w * gain) + abs(u - 1.01f * w) + max(u, w) * min(u, 1.0f) +
            clamp(w, 0.5f, 1.5f) + lerp(u, w, gain * 0.5f) + (u * 4.0f) % 1.0f +
            floor(u * 3.0f) * w + u / w + select(u > w, u * w, -u);
  g(x, y) = f(x, y);
  g(r, y) = g(r, y) * 0.5f + sin(g(r - 1, y)) * image(r, y);
  loss() += g(all.x, all.y) * gain;
  GradientReport report = check_gradients(loss, {}, {.directions = 2});
  EXPECT_EQ(report.complex_step_refused, "");
  for (const auto& input : report.inputs) {
    EXPECT_GT(input.complex_step_error, 0) << "it was computed";
    EXPECT_LT(input.complex_step_error, 1e-11) << report.to_json();
  }
}

TEST_F(CheckGradients, TheComplexStepIsRefusedWithTheReason) {
  Func f("f");
  f(x, y) = erf(image(x, y)) * gain;
  GradientReport report = check_gradients(f, {12, 9}, {.directions = 1});
  expect_mentions(report.complex_step_refused, {"\"erf\""});
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
  EXPECT_EQ(report.inputs[0].methods.size(), 4u);
}

TEST_F(CheckGradients, AllFloatingValuesOfATupleAreSummed) {
  Func pair("pair"), f("f");
  pair(x, y) = Tuple(image(x, y) * gain, cast<int>(image(x, y) * 4.0f), sin(image(x, y)));
  f(x, y) = Tuple(pair(x, y)[0] * pair(x, y)[2], pair(x, y)[1],
                  pair(11 - x, y)[2] + cast<float>(pair(x, y)[1]));
  GradientReport report = check_gradients(f, {12, 9}, {.directions = 2});
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
  EXPECT_LT(report.inputs[0].complex_step_error, 1e-12) << report.to_json();
  ASSERT_GE(report.funcs.size(), 2u) << "Tuples' adjoints are compared too";
}

TEST_F(CheckGradients, OnlyWantedInputsAreMoved) {
  Func f("f");
  f(x, y) = image(x, y) * gain;
  GradientReport report = check_gradients(f, {12, 9}, {.directions = 1, .wrt = {gain}});
  ASSERT_EQ(report.inputs.size(), 1u);
  EXPECT_EQ(report.inputs[0].name, gain.name());
  EXPECT_LT(report.worst_error, 1e-8);
}

TEST_F(CheckGradients, OutputsWithDimensionsAndUpdates) {
  Func f("f");
  RDom r(1, 7);
  f(x, y) = image(x, y) * gain;
  f(x, r) = sin(f(x, r - 1)) + f(x, r) * image(x, r + 1);
  GradientReport report = check_gradients(f, {12, 8});
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
}

// Unscheduled Funcs are not recomputed for each read: recomputation would give four filters in a row 25^4 terms for
// each element.
TEST_F(CheckGradients, FiltersOfFiltersThatNobodyScheduled) {
  const Buffer<float> picture = random_image({40, 40}, 0.1, 0.5, 2);
  Buffer<float> weights = random_image({5, 5}, 0.03, 0.05, 3);
  Func stage("stage"), loss("loss");
  stage(x, y) = picture(x, y);
  for (int s = 0; s < 4; ++s) {
    Func next("next");
    RDom r(0, 5, 0, 5);
    next(x, y) = 0.0f;
    next(x, y) += weights(r.x, r.y) * stage(x + r.x, y + r.y) * stage(x + r.x, y + r.y);
    stage = next;
  }
  RDom all(0, 12, 0, 12);
  loss() = 0.0f;
  loss() += stage(all.x, all.y);
  const GradientReport report = check_gradients(loss, {}, {.directions = 1, .wrt = {weights}});
  EXPECT_LT(report.worst_error, 1e-7) << report.to_json();
}

TEST_F(CheckGradients, AWrongGradientIsFound) {
  Func f("f");
  f(x, y) = image(x, y) * image(x, y) + stop_gradient(image(x, y) * 0.01f);
  GradientReport report = check_gradients(f, {12, 9});
  EXPECT_GT(report.inputs[0].adjoint_error, 1e-4) << report.to_json();
  EXPECT_GT(report.inputs[0].complex_step_error, 1e-4) << "it does not know of stop_gradient";
  EXPECT_LT(report.inputs[0].dot_product_error, 1e-12) << "both modes stop there";
}

// factor 2: the right rule. The rule reads a Buffer of its own, which also needs a copy in double.
void give_rules(const Func& f, const ImageParam& image, float adjoint_factor,
                float tangent_factor) {
  Buffer<float> half(1);
  half(0) = 0.5f;
  custom_adjoint(f, {image}, [=](const AdjointContext& c) {
    Func adjoint("rule");
    Var u("u"), v("v");
    adjoint(u, v) =
        2.0f * adjoint_factor * half(Expr(0)) * ImageParam(image)(u, v) * c.adjoint()(u, v);
    return std::vector<AdjointContribution>{{image, adjoint}};
  });
  if (tangent_factor == 0) return;
  custom_tangent(f, {image}, [=](const TangentContext& c) {
    Func tangent("rule_tan");
    Var u("u"), v("v");
    tangent(u, v) = tangent_factor * ImageParam(image)(u, v) * c.tangent(image)(u, v);
    return tangent;
  });
}

TEST_F(CheckGradients, RulesOfTheUserAreCheckedLikeAnyOther) {
  auto report = [&](float adjoint_factor, float tangent_factor) {
    Func f("f"), g("g");
    f(x, y) = image(x, y) * image(x, y);
    give_rules(f, image, adjoint_factor, tangent_factor);
    g(x, y) = f(x, y) * gain;
    return check_gradients(g, {12, 9}, {.directions = 1, .wrt = {image}});
  };
  EXPECT_LT(report(2, 2).worst_error, 1e-8);
  EXPECT_LT(report(2, 0).worst_error, 1e-8) << "tangents of the definitions";
  EXPECT_GT(report(1, 1).inputs[0].adjoint_error, 0.4);
  EXPECT_LT(report(1, 1).inputs[0].dot_product_error, 1e-12) << "both rules are wrong alike";
  EXPECT_GT(report(2, 3).inputs[0].dot_product_error, 0.3);
  EXPECT_GT(report(1, 0).inputs[0].dot_product_error, 0.4);
}

TEST_F(CheckGradients, OutputsMayBeginAnywhere) {
  Func f("f");
  f(x, y) = image(x + 3, y - 2) * image(x + 4, y - 1);  // defined from (-3, 2) on only
  GradientReport report = check_gradients(f, {11, 8}, {.directions = 1, .mins = {-3, 2}});
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
  expect_error({"1 mins", "Give one a dimension"}, [&] {
    check_gradients(f, {11, 8}, {.mins = {1}});
  });
}

TEST_F(CheckGradients, NarrowFloats) {
  for (Type type : {Float(16), BFloat(16)}) {
    ImageParam narrow(type, 1, "narrow");
    Func values("values"), f("f");
    values(x) = cast(type, cast<float>(x % 7) * 0.3f + 0.5f);
    narrow.set(values.realize({12}));
    f(x) = narrow(x) * narrow(11 - x) * narrow(x);
    GradientReport report = check_gradients(f, {12}, {.directions = 1});
    EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
    EXPECT_GT(report.inputs[0].own_precision_error, 1e-6) << "values are rounded to 16 bits";
    EXPECT_LT(report.inputs[0].own_precision_error, 0.05);
  }
}

TEST_F(CheckGradients, TheFuncThatLosesTheDigitsIsNamed) {
  Func smooth("smooth"), cancels("cancels"), f("f");
  smooth(x, y) = image(x, y) * 2.0f;
  cancels(x, y) = cos(smooth(x, y) * smooth(x, y) * 1e5f);  // its partial has no digits in float32
  f(x, y) = cancels(x, y) * 3.0f;
  GradientReport report = check_gradients(f, {12, 9}, {.directions = 1});
  EXPECT_EQ(report.loses_digits, "smooth") << report.to_json();
}

TEST_F(CheckGradients, TheReportIsJson) {
  Func f("f");
  f(x, y) = image(x, y) * gain;
  auto json = nlohmann::json::parse(check_gradients(f, {4, 4}).to_json());
  EXPECT_EQ(json["inputs"].size(), 2u);
  EXPECT_EQ(json["inputs"][0]["steps"].size(), 11u);
  EXPECT_TRUE(json["worst_error"].is_number());
}

TEST_F(CheckGradients, ErrorsNameWhatIsMissing) {
  Func f("f"), pair("pair");
  ImageParam unbound(Float(32), 2, "unbound");
  f(x, y) = image(x, y) + unbound(x, y);
  expect_error<RuntimeError>({"\"unbound\"", "Set it"}, [&] { check_gradients(f, {4, 4}); });
  Func g("g");
  g(x, y) = image(x, y);
  expect_error({"2 dimensions", "1 sizes", "Give one a dimension"},
               [&] { check_gradients(g, {4}); });
  pair(x, y) = {cast<int>(image(x, y)), 1};
  expect_error<Unsupported>({"integers only", "Check a Func of floats"}, [&] {
    check_gradients(pair, {4, 4});
  });
  expect_error({"something else", "Param"}, [&] {
    check_gradients(g, {4, 4}, {.wrt = {unbound}});
  });
}

}  // namespace
}  // namespace retrograde::gradient
