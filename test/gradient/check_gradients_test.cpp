// check_gradients finds right gradients right and wrong ones wrong. A wrong gradient is made with
// stop_gradient, whose derivative is not that of the values; lost digits by a cancellation.
#include <nlohmann/json.hpp>

#include "checks/check_gradients.h"
#include "frontend/image_param.h"
#include "frontend/param.h"
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
    ASSERT_EQ(input.steps.size(), 11u);
    EXPECT_GT(input.steps.front().central_error, input.steps[4].central_error);
    EXPECT_GT(input.steps.front().seconds, 0);
  }
  EXPECT_GE(report.funcs.size(), 4u);
}

TEST_F(CheckGradients, OutputsWithDimensionsAndUpdates) {
  Func f("f");
  RDom r(1, 7);
  f(x, y) = image(x, y) * gain;
  f(x, r) = sin(f(x, r - 1)) + f(x, r) * image(x, r + 1);
  GradientReport report = check_gradients(f, {12, 8});
  EXPECT_LT(report.worst_error, 1e-8) << report.to_json();
}

TEST_F(CheckGradients, AWrongGradientIsFound) {
  Func f("f");
  f(x, y) = image(x, y) * image(x, y) + stop_gradient(image(x, y) * 0.01f);
  GradientReport report = check_gradients(f, {12, 9});
  EXPECT_GT(report.inputs[0].adjoint_error, 1e-4) << report.to_json();
  EXPECT_LT(report.inputs[0].dot_product_error, 1e-12) << "both modes stop there";
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
  expect_mentions(error_of<RuntimeError>([&] {
                    check_gradients(f, {4, 4});
                  }),
                  {"\"unbound\"", "Set it"});
  Func g("g");
  g(x, y) = image(x, y);
  expect_mentions(error_of<CompileError>([&] { check_gradients(g, {4}); }),
                  {"2 dimensions", "1 sizes"});
  pair(x, y) = {image(x, y), image(x, y)};
  EXPECT_THROW(check_gradients(pair, {4, 4}), Unsupported);
}

}  // namespace
}  // namespace retrograde::gradient
