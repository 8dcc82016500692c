// Tests adjoints of reads at constant indices: of channels, of the parameters of a camera, of coefficients. They share
// their sums (autodiff/sums/constant_places.h), so that nothing is computed once for each index, and loops over few
// values are written out where terms choose by them (chosen_terms.h). Gradients are compared with differences.
#include "autodiff/sums/constant_places.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "gradient/programs_suite.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

const Var i("i");

// The Funcs with the sums of several places.
std::vector<Func> shared_sums(const Derivative& d) {
  std::vector<Func> result;
  for (const Func& f : d.funcs()) {
    const std::string& name = f.name();
    const auto at = name.find("_places");
    const std::string rest = at == std::string::npos ? "?" : name.substr(at + 7);
    if (rest.find_first_not_of("$0123456789") == std::string::npos) result.push_back(f);
  }
  return result;
}
size_t values_of_sum(const Derivative& d) {
  const std::vector<Func> sums = shared_sums(d);
  return sums.size() == 1 ? sums[0].types().size() : 0;
}

double nonlinear(const Derivative& d) {
  return d.operations().gradient.nonlinear().value().value_or(-1);
}

Expr dear(const Expr& e) { return tanh(e) + exp(-e * e); }

// f(x) = dear(p(0) a(x) + p(1) a(x)^2 + ...), read at `count` constant indices
Func polynomial(const Buffer<float>& p, const Buffer<float>& a, int count) {
  Func f("f");
  Expr sum = 0.0f, power = 1.0f;
  for (int k = 0; k < count; ++k) {
    power = power * a(x);
    sum = sum + p(Expr(k)) * power;
  }
  f(x) = dear(sum);
  return f;
}

TEST(ConstantPlaces, TwoCoefficientsShareASum) {
  Buffer<float> p = line(2), a = line(40);
  const Func loss = weighted_sum(polynomial(p, a, 2), {40});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(values_of_sum(d), 2u) << d.explain(Detail::All);
  expect_gradient(loss, d, p);
  expect_gradient(loss, d, a);
}

TEST(ConstantPlaces, NothingIsComputedOncePerIndex) {
  Buffer<float> p = line(6), a = line(64);
  const auto operations_with = [&](int count) {
    AdjointOptions options;
    options.wrt = {p};
    return nonlinear(propagate_adjoints(weighted_sum(polynomial(p, a, count), {64}), options));
  };
  EXPECT_GT(operations_with(1), 0);
  EXPECT_EQ(operations_with(3), operations_with(1));
  EXPECT_EQ(operations_with(6), operations_with(1));
}

TEST(ConstantPlaces, ThreeChannelsOfAPixelAreComputedTogether) {
  Buffer<float> image = random_image({5, 4, 3}, 0.25, 1, 3);
  Func f("f");
  const Expr r = image(x, y, 0), g = image(x, y, 1), b = image(x, y, 2);
  f(x, y) = dear(r * g + b) * dear(r + g * b) + exp(r - b);
  const Func loss = weighted_sum(f, {5, 4});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(values_of_sum(d), 3u) << d.explain(Detail::All);
  expect_gradient(loss, d, image);
  AdjointOptions options;
  options.wrt = {f};
  const double before = nonlinear(propagate_adjoints(loss, options));
  EXPECT_LE(nonlinear(d) - before, 5 * 4 * 12) << "the stage's functions, once for each pixel";
}

TEST(ConstantPlaces, ChannelsInnermostInMemory) {
  Buffer<float> image = random_image({3, 33, 2}, 0.25, 1, 3);
  Func f("f");
  f(x, y) = dear(image(0, x, y) * image(1, x, y)) * dear(image(2, x, y));
  const Func loss = weighted_sum(f, {33, 2});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(values_of_sum(d), 3u) << d.explain(Detail::All);
  expect_gradient(loss, d, image);
}

// Residuals of observations by cameras.
struct Observations {
  Buffer<float> cameras = random_image({4, 3}, 0.25, 1, 5),
                points = random_image({2, 7}, 0.5, 2, 6);
  Buffer<int> camera_of = places(40, 3, 7), point_of = places(40, 7, 8);
  Func residual{"residual"};
  Observations() {
    const Expr camera = clamp(camera_of(i), 0, 2), point = clamp(point_of(i), 0, 6);
    const Expr u = points(0, point), v = points(1, point);
    const Expr turned = cameras(0, camera) * u + cameras(1, camera) * v;
    const Expr scale = dear(turned) * cameras(2, camera) + cameras(3, camera);
    residual(c, i) = select(c == 0, scale * u, exp(scale) * v);
  }
  Func loss() const { return weighted_sum(residual, {2, 40}); }
};

TEST(ConstantPlaces, ConstantsBesideADataDependentIndex) {
  Observations o;
  const Func loss = o.loss();
  const Derivative d = propagate_adjoints(loss);
  const std::vector<Func> sums = shared_sums(d);
  ASSERT_EQ(sums.size(), 2u) << d.explain(Detail::All);
  for (const Func& sum : sums) EXPECT_EQ(sum.dimensions(), 1) << "only the data-dependent one";
  expect_gradient(loss, d, o.cameras);
  expect_gradient(loss, d, o.points);
}

TEST(ConstantPlaces, CoordinatesAreWrittenOutWhereTermsChooseByThem) {
  Observations o;
  AdjointOptions options;
  options.wrt = {o.cameras};
  const Derivative d = propagate_adjoints(o.loss(), options);
  // dear() and its derivative take at most 4 functions, and exp(scale) one, for each observation: not for each of its
  // two coordinates, and not for each of the four parameters.
  const double per_observation = nonlinear(d) / 40;
  EXPECT_GT(per_observation, 0);
  EXPECT_LE(per_observation, 5 + 5) << "the adjoint of the residual recomputes the residual";
}

TEST(ConstantPlaces, ConstantAndGeneralReadsOfOneFunc) {
  Buffer<float> image = random_image({4, 6}, 0.25, 1, 9);
  Func f("f");
  f(x, y) = dear(image(0, y) * image(2, y)) * image(x, y) + dear(image(0, y) - image(3, y));
  const Func loss = weighted_sum(f, {4, 6});
  expect_gradient(loss, image);
}

TEST(ConstantPlaces, TheSameConstantTwice) {
  Buffer<float> p = line(3), a = line(24);
  Func f("f");
  f(x) = dear(p(Expr(1)) * a(x) + p(Expr(2))) + dear(p(Expr(1)) - a(x)) * p(Expr(1));
  const Func loss = weighted_sum(f, {24});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(values_of_sum(d), 2u) << d.explain(Detail::All);
  expect_gradient(loss, d, p);
}

TEST(ConstantPlaces, ASingleConstantKeepsItsOwnUpdate) {
  Buffer<float> p = line(1), a = line(24), one = line(1, 4);
  Func f("f");
  f(x) = dear(p(Expr(0)) * a(x) + one(Expr(0)));
  const Func loss = weighted_sum(f, {24});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_TRUE(shared_sums(d).empty());
  expect_gradient(loss, d, p);
  expect_gradient(loss, d, one);
}

TEST(ConstantPlaces, FewPlanesOfMany) {
  Buffer<float> image = random_image({6, 40}, 0.25, 1, 10);
  Func f("f");
  f(x) = dear(image(x, 3) * image(x, 31)) * dear(image(x, 3) + image(x, 17));
  const Func loss = weighted_sum(f, {6});
  expect_gradient(loss, image);
}

TEST(ConstantPlaces, ConstantsInTwoDimensions) {
  Buffer<float> m = random_image({2, 3}, 0.25, 1, 11), a = line(30);
  Func f("f");
  const auto at = [&](int column, int row) { return m(Expr(column), Expr(row)); };
  f(x) = dear(at(0, 0) * a(x) + at(1, 0)) * dear(at(0, 2) + at(1, 2) * a(x)) + at(1, 1);
  const Func loss = weighted_sum(f, {30});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(values_of_sum(d), 5u) << d.explain(Detail::All);
  expect_gradient(loss, d, m);
}

TEST(ConstantPlaces, ValuesOfATuple) {
  Buffer<float> a = random_image({3}, 0.25, 1, 12), b = line(30);
  Func pair("pair"), f("f");
  pair(c) = Tuple(a(c) * 2.0f, exp(a(c)));
  const auto at = [&](int k, int value) { return Expr(pair(k)[value]); };
  f(x) = dear(at(0, 0) * b(x) + at(1, 1)) * dear(at(1, 0) - at(2, 1) * b(x));
  const Func loss = weighted_sum(f, {30});
  expect_gradient(loss, a);
}

TEST(ConstantPlaces, MoreThanOneSumHolds) {
  Buffer<float> p = random_image({40}, -0.25, 0.25, 13), a = random_image({20}, 0.25, 1, 14);
  const Func loss = weighted_sum(polynomial(p, a, 40), {20});
  const Derivative d = propagate_adjoints(loss);
  const std::vector<Func> sums = shared_sums(d);
  EXPECT_EQ(sums.size(), 3u);
  for (const Func& sum : sums) EXPECT_LE(sum.types().size(), 16u);
  expect_gradient(loss, d, p, 1e-4);
}

TEST(ConstantPlaces, CheapTermsOfAPixelStayWhereTheyAre) {
  Buffer<float> image = random_image({5, 4, 3}, 0.25, 1, 3);
  Func f("f");
  f(x, y) = 0.25f * image(x, y, 0) + 0.5f * image(x, y, 1) + 0.25f * image(x, y, 2);
  const Func loss = weighted_sum(f, {5, 4});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_TRUE(shared_sums(d).empty()) << "storing the sums would take longer";
  expect_gradient(loss, d, image);
}

TEST(ConstantPlaces, SumsOverFewValuesAreWrittenOut) {
  Buffer<float> image = random_image({5, 4, 3}, 0.25, 1, 3);
  Func f("f"), mixed("mixed");
  f(x, y, c) = image(x, y, c) * image(x, y, c);
  mixed(x, y, c) = mux(c, {f(x, y, 0) + f(x, y, 1), f(x, y, 1) * 2.0f, f(x, y, 2) - f(x, y, 0)});
  const Func loss = weighted_sum(mixed, {5, 4, 3});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_TRUE(d(f).num_update_definitions() == 0) << d.explain(Detail::All);
  expect_gradient(loss, d, image);
}

// 300,000 terms in float32 would be wrong by 1e-3.
TEST(ConstantPlaces, LongSumsKeepTheirDigits) {
  constexpr int n = 300'000;
  Buffer<float> p(2), a(n);
  p.fill(1), a.fill(0.1f);
  Func f("f"), loss("loss");
  RDom r(0, n);
  f(x) = sqrt(p(Expr(0)) * a(x) + p(Expr(1))) * 2.0f;
  loss() = 0.0f;
  loss() += f(r);
  const Derivative d = propagate_adjoints(loss);
  ASSERT_EQ(shared_sums(d).size(), 1u) << d.explain(Detail::All);
  const Buffer<float> found = d(p).realize({2});
  const double root = std::sqrt(static_cast<double>(0.1f) + 1);
  EXPECT_NEAR(found(0), n * static_cast<double>(0.1f) / root, 1e-6 * n * 0.1);
  EXPECT_NEAR(found(1), n / root, 1e-6 * n);
}

}  // namespace
}  // namespace retrograde::gradient
