// Tests second and third derivatives: Hessian-vector products against differences of the gradient in double, and their
// symmetry <H v, w> = <v, H w>, also over random programs. Third derivatives are checked against differences of the
// products.
#include "autodiff/second_order.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"

namespace retrograde::gradient {
namespace {

std::vector<double> values_of(const oracle::Array& a) {
  std::vector<double> result;
  for (const oracle::Value& v : a.values) result.push_back(v.scalar.as_double());
  return result;
}
std::vector<double> values_of(const Buffer<float>& b) {
  std::vector<double> result;
  b.get()->for_each_value([&](float v) { result.push_back(v); });
  return result;
}
double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// The derivative of f when `image` moves along v, element by element; the error is of fourth order in the step.
std::vector<double> differences(const Func& f, Buffer<float>& image, const Buffer<float>& v,
                                const oracle::Region& region) {
  Buffer<float> kept = image.copy();
  auto at = [&](float h) {
    image.get()->for_each_element(
        [&](const int* i) { (*image.get())(i) = (*kept.get())(i) + h * (*v.get())(i); });
    return values_of(evaluate(f, region));
  };
  auto slope = [&](float h) {
    std::vector<double> up = at(h), down = at(-h);
    for (size_t i = 0; i < up.size(); ++i) up[i] = (up[i] - down[i]) / (2.0 * h);
    return up;
  };
  std::vector<double> coarse = slope(1.0f / 128), fine = slope(1.0f / 256);
  for (size_t i = 0; i < fine.size(); ++i) fine[i] = (4 * fine[i] - coarse[i]) / 3;
  at(0);
  return fine;
}

class Hessians : public ::testing::Test {
 protected:
  Var x{"x"};
  Buffer<float> a = random_image({6}, 0.25, 1.5, 1), v = random_image({6}, -1, 1, 2),
                w = random_image({6}, -1, 1, 3);
  const oracle::Region all{{0}, {6}};

  Func loss_with_a_stencil() {
    Func f("f"), loss("loss");
    RDom r(0, 5);
    f(x) = sin(a(x)) * a(x + 1);
    loss() = 0.0f;
    loss() += f(r) * f(r) + exp(-a(r)) / (1.0f + a(r + 1));
    return loss;
  }
  Func loss_with_a_scan() {
    Func f("f"), loss("loss");
    RDom r(1, 5);
    f(x) = a(x);
    f(r) = tanh(f(r - 1)) * a(r) + f(r - 1) * 0.5f;
    loss() = f(5) * f(3);
    return loss;
  }
  void expect_second_and_third(const Func& loss) {
    Func gradient = propagate_adjoints(loss, {.overwritten = Overwritten::Store})(a);
    Func hv = hessian_vector_product(loss, a, {{a, v}}),
         hw = hessian_vector_product(loss, a, {{a, w}});
    std::vector<double> found = values_of(evaluate(hv, all));
    std::vector<double> expected = differences(gradient, a, v, all);
    for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-5) << i;
    EXPECT_NEAR(dot(found, values_of(w)), dot(values_of(evaluate(hw, all)), values_of(v)), 1e-12);
    EXPECT_GT(std::abs(dot(found, found)), 1e-3);
    expect_machine_code_agrees(hv, all);

    Func third = propagate_tangents(hv, {{a, w}})(hv);
    found = values_of(evaluate(third, all));
    expected = differences(hv, a, w, all);
    for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-4) << i;
    EXPECT_GT(std::abs(dot(found, found)), 1e-4);
  }
};

TEST_F(Hessians, OfStencilsAndReductions) { expect_second_and_third(loss_with_a_stencil()); }

TEST_F(Hessians, OfScans) { expect_second_and_third(loss_with_a_scan()); }

TEST_F(Hessians, BlocksBetweenTwoInputs) {
  Param<float> gain("gain");
  gain.set(0.75f);
  Func loss("loss"), one("one");
  RDom r(0, 6);
  loss() = 0.0f;
  loss() += a(r) * a(r) * gain * gain;
  one() = 1.0f;
  std::vector<double> mixed =
      values_of(evaluate(hessian_vector_product(loss, a, {{gain, one}}), all));
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(mixed[static_cast<size_t>(i)], 4 * a(i) * 0.75, 1e-12);
}

TEST_F(Hessians, AdjointsOfAdjointsAgreeWithTangentsOfAdjoints) {
  Func loss = loss_with_a_stencil();
  Func gradient = propagate_adjoints(loss)(a);
  Func along("along");
  RDom r(0, 6);
  along() = 0.0f;
  along() += gradient(r) * v(r);
  Func reverse = propagate_adjoints(along)(a), forward = hessian_vector_product(loss, a, {{a, v}});
  std::vector<double> left = values_of(evaluate(reverse, all)),
                      right = values_of(evaluate(forward, all));
  for (size_t i = 0; i < left.size(); ++i) EXPECT_NEAR(left[i], right[i], 1e-12);
}

TEST_F(Hessians, AnInputWithoutGradientIsAnError) {
  Param<int> count("count");
  Func loss = loss_with_a_stencil();
  expect_error({"twice", "no gradient"}, [&] { hessian_vector_product(loss, count, {{a, v}}); });
}

}  // namespace
}  // namespace retrograde::gradient
