// Gradients of complete programs against central differences.
#include "gradient/gradient_check.h"
#include "support/facts.h"
#include "support/measured_threads.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), c("c"), t("t");

class Programs : public ::testing::Test {
 protected:
  Buffer<float> a = random_image({9}, 0.25, 2, 1);
  Buffer<float> image = random_image({7, 6}, 0.25, 2, 2);

  // Checks the gradient by the image's present contents, over the image's size.
  void expect_right(const Func& loss, const Func& gradient) {
    const oracle::Region region = oracle::region_of(*image.raw_buffer());
    const oracle::Array found = evaluate(gradient, region);
    region.for_each([&](const std::vector<int>& point) {
      const double expected = difference(loss, image, point);
      EXPECT_NEAR(found.at(point).scalar.as_double(), expected, 1e-5 * (1 + std::abs(expected)));
    });
    expect_machine_code_agrees(gradient, region);
  }
};

// Cells are found from float coordinates, as when an image is scaled.
TEST_F(Programs, BilateralSliceOfCellsByFloatCoordinates) {
  Buffer<float> grid = random_image({4, 3, 3}, -1, 1, 9);
  const Expr gx = cast<float>(x) * (3 / 7.0f), gy = cast<float>(y) * (2 / 6.0f);
  const Expr gz = clamp(image(x, y), 0.0f, 1.99f);
  const Expr i = cast<int>(floor(gx)), j = cast<int>(floor(gy)), k = cast<int>(floor(gz));
  const auto plane = [&](const Expr& at) {
    return lerp(lerp(grid(i, j, at), grid(i + 1, j, at), gx - floor(gx)),
                lerp(grid(i, j + 1, at), grid(i + 1, j + 1, at), gx - floor(gx)), gy - floor(gy));
  };
  Func sliced("sliced");
  sliced(x, y) =
      lerp(plane(clamp(k, 0, 1)), plane(clamp(k, 0, 1) + 1), gz - floor(gz)) * image(x, y);
  Func loss = weighted_sum(sliced, {7, 6});
  expect_gradient(loss, grid);
  expect_gradient(loss, image);
}

TEST_F(Programs, RotationDiagonalAndTranspose) {
  Func f("f"), g("g");
  f(x, y) = image(y, 5 - x) * image(x, y);
  g(x) = f(x, x) + image(x, x) * image(x + 1, x);
  Func loss = weighted_sum(g, {5});
  expect_gradient(loss, image);
}

TEST_F(Programs, BoundaryConditions) {
  for (int which = 0; which < 5; ++which) {
    SCOPED_TRACE(which);
    Func bounded;
    if (which == 0) bounded = BoundaryConditions::repeat_edge(image);
    if (which == 1) bounded = BoundaryConditions::constant_exterior(image, 0.5f);
    if (which == 2) bounded = BoundaryConditions::repeat_image(image);
    if (which == 3) bounded = BoundaryConditions::mirror_image(image);
    if (which == 4) bounded = BoundaryConditions::mirror_interior(image);
    Func blur("blur");
    RDom r(-2, 5, -1, 3);
    blur(x, y) = sum(bounded(x + r.x, y + r.y) * cast<float>(r.x + 2 * r.y + 6));
    Func loss = weighted_sum(blur, {7, 6});
    expect_gradient(loss, image);
  }
}

TEST_F(Programs, BoundaryConditionsOfParametricSize) {
  for (int which = 0; which < 5; ++which) {
    SCOPED_TRACE(which);
    ImageParam in(Float(32), 2, "in");
    in.set(image);
    Func bounded;
    if (which == 0) bounded = BoundaryConditions::repeat_edge(in);
    if (which == 1) bounded = BoundaryConditions::constant_exterior(in, 0.5f);
    if (which == 2) bounded = BoundaryConditions::repeat_image(in);
    if (which == 3) bounded = BoundaryConditions::mirror_image(in);
    if (which == 4) bounded = BoundaryConditions::mirror_interior(in);
    Func blur("blur");
    blur(x, y) = bounded(x - 2, y) * 0.5f + bounded(x + 1, y - 1) * bounded(x, y + 2);
    Func loss = weighted_sum(blur, {7, 6});
    expect_right(loss, propagate_adjoints(loss)(in));
  }
}

TEST_F(Programs, ParamsAndTuples) {
  Param<float> gain("gain", 1.5f);
  Func f("f"), g("g");
  f(x) = Tuple(a(x) * gain, sin(a(x)) + gain);
  g(x) = f(x)[0] * f(x + 1)[1] + f(x)[1];
  Func loss = weighted_sum(g, {8});
  Derivative d = propagate_adjoints(loss);
  expect_gradient(loss, d, a);
  double found = evaluate_scalar(d(gain));
  gain.set(1.5f + 1.0f / 256);
  double up = evaluate_scalar(loss);
  gain.set(1.5f - 1.0f / 256);
  double down = evaluate_scalar(loss);
  EXPECT_NEAR(found / ((up - down) * 128), 1, 1e-4);
}

TEST_F(Programs, DataDependentGatherScatters) {
  Func index("index"), f("f");
  index(x) = cast<int>(floor(a(x) * 3.5f));
  f(x) = a(clamp(index(x), 0, 8)) * a(x);
  Func loss = weighted_sum(f, {9});
  Derivative d = propagate_adjoints(loss);
  expect_gradient(loss, d, a);
  expect_fact(d.explanations(), Fact::Scattered, a.name(),
              "read by \"f\": an index depends on \"index\"");
}

// Numbers of these types wrap around at 2^8, 2^16 or 2^32, or exceed int32.
template <class T>
void expect_place_chosen_by_data_of_the_row(Buffer<float>& image) {
  Buffer<T> row(6);
  for (int i = 0; i < 6; ++i) row(i) = static_cast<T>(i * 50 + (i % 2) * 3000000000u);
  const auto number = [](int n) { return cast(type_of<T>(), Expr(n)); };
  Expr v = row(y);
  for (const Expr& shifts : {v + number(100) > number(120), v - number(60) < number(90),
                             v * number(3) < number(100), v > number(70)}) {
    Func f("f");
    f(x, y) = image(select(shifts, x, x + 2), y);
    Func loss = weighted_sum(f, {5, 6});
    Derivative d = propagate_adjoints(loss);
    expect_gradient(loss, d, image);
    EXPECT_EQ(details_of(d.explanations(), Fact::Scattered), std::vector<std::string>());
  }
}
TEST_F(Programs, PlaceChosenByUnsignedAndNarrowDataOfTheRow) {
  expect_place_chosen_by_data_of_the_row<uint8_t>(image);
  expect_place_chosen_by_data_of_the_row<int8_t>(image);
  expect_place_chosen_by_data_of_the_row<uint16_t>(image);
  expect_place_chosen_by_data_of_the_row<uint32_t>(image);
  expect_place_chosen_by_data_of_the_row<int64_t>(image);
}

TEST_F(Programs, BilateralSlice) {
  const int size = 4, cells = 3;
  Buffer<float> photo = random_image({12, 12}, 0.05, 0.95, 5);
  Buffer<float> grid = random_image({2, cells, cells, 3}, -1, 1, 6);
  Func out("out");
  auto low = [&](const Expr& v) { return (2 * v + 1 - size) / (2 * size); };
  auto at = [&](const Expr& v) { return clamp(v, 0, cells - 1); };
  Expr z = photo(x, y) * 3.0f - 0.5f, iz = cast<int>(floor(z)), wz = z - floor(z);
  Expr result = 0.0f;
  for (int dx = 0; dx < 2; ++dx) {
    for (int dz = 0; dz < 2; ++dz) {
      Expr fx = (2.0f * cast<float>(x) + 1.0f - size) / (2.0f * size), wx = fx - floor(fx);
      result = result + (dx ? wx : 1.0f - wx) * (dz ? wz : 1.0f - wz) *
                            grid(c, at(low(x) + dx), at(low(y)), clamp(iz + dz, 0, 2));
    }
  }
  out(x, y, c) = result;
  Func loss = weighted_sum(out, {12, 12, 2});
  Derivative d = propagate_adjoints(loss);
  expect_gradient(loss, d, grid);
  Func adjoint = d(grid);
  for (int i = 0; i < adjoint.num_update_definitions(); ++i) {
    std::vector<Expr> lhs = adjoint.update_args(i);
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(lhs[static_cast<size_t>(k)].as<ir::Variable>()) << "race-free in all but depth";
  }
}

// ---- updates ----

// Sizes are known only when the pipeline is called.
TEST_F(Programs, ParametricSizes) {
  ImageParam in(Float(32), 2, "in");
  in.set(image);
  Buffer<float> kernel = random_image({3, 3}, -1, 1, 8);
  Func bounded = BoundaryConditions::repeat_edge(in), blur("blur"), down("down"), loss("loss");
  RDom k(0, 3, 0, 3), all(0, in.width(), 0, in.height() / 2);
  blur(x, y) = 0.0f;
  blur(x, y) += bounded(x + k.x - 1, y + k.y - 1) * kernel(k.x, k.y);
  down(x, y) = blur(x, 2 * y) * blur(x, 2 * y + 1);
  loss() = 0.0f;
  loss() += down(all.x, all.y) * cast<float>(all.x + 2 * all.y + 1);
  Derivative d = propagate_adjoints(loss);
  expect_gradient(loss, d, kernel);
  expect_right(loss, d(in));
}

// The steps of this recurrence are counted at run time. There may be no step that reads the end of the clamp; the other
// steps still count.
TEST_F(Programs, ARecurrenceThatMayNotReachTheEndOfAClamp) {
  Param<int> steps("steps");
  Func f("f");
  RDom r(0, steps);
  f(x) = a(x);
  f(r) = f(clamp(r - 1, 0, 4)) * 2.0f;
  Func loss = weighted_sum(f, {9});
  Derivative d = propagate_adjoints(loss);
  for (const int count : {1, 3, 5, 6, 9}) {
    SCOPED_TRACE(count);
    steps.set(count);
    expect_gradient(loss, d, a);
  }
}

// The adjoint of clamp(x, 0, p) adds to element p, which exists in the image only if it is read.
TEST_F(Programs, AClampWiderThanTheImageIsNotReachedAndAddsNowhere) {
  Param<int> p("p");
  p.set(50);
  Func f("f");
  f(x, y) = image(clamp(x, 0, p), clamp(y, 0, 2 * p)) * image(clamp(2 * y, 0, p / 20), y);
  expect_gradient(weighted_sum(f, {7, 6}), image);
}

TEST_F(Programs, AClampToSizesOfAnImageAddsInsideOfIt) {
  ImageParam in(Float(32), 2, "in");
  in.set(image);
  Func f("f");
  const Expr w = in.width(), h = in.height();
  f(x) = pow(in(clamp(2 * x + 1, 0, w - 1), h - 1 - clamp(x + cast<int>(x < 4), 0, h - 1)), 2);
  Func gradient = propagate_adjoints(weighted_sum(f, {5}))(in);
  expect_machine_code_agrees(gradient, {{0, 0}, {7, 6}});
}

// A buffer up to element p would take 8 GB.
TEST_F(Programs, AClampWiderThanAFuncTakesNoRoom) {
  Param<int> p("p");
  p.set(5000000);
  Func f("f"), g("g");
  f(x) = sin(image(x, 0));
  g(x) = f(clamp(x, 0, p)) + f(clamp(x + 1, 0, p)) * 2.0f;
  Derivative d = propagate_adjoints(weighted_sum(g, {6}));
  Func of_f = d.adjoint(f);
  of_f.compute_root();
  Func gradient = d(image);
  MeasuredThreads context(1);
  Buffer<float> result(7, 6);
  gradient.realize(&context, result);
  EXPECT_LT(context.peak_bytes(), 1000);
  expect_machine_code_agrees(gradient, {{0, 0}, {7, 6}});
}

TEST_F(Programs, DeepChainOfStencilsIsNotInlined) {
  std::vector<Func> chain;
  Buffer<float> wide = random_image({70}, 0.25, 2, 21);
  for (int i = 0; i < 24; ++i) {
    Func f("stage");
    auto at = [&](const Expr& p) { return i == 0 ? Expr(wide(p)) : Expr(chain.back()(p)); };
    f(x) = (at(x) + at(x + 1) * 0.5f + at(x + 2)) * 0.4f;
    f.compute_root();
    chain.push_back(f);
  }
  Func loss = weighted_sum(chain.back(), {9});
  Derivative d = propagate_adjoints(loss);
  expect_machine_code_agrees(d(wide), {{0}, {57}});
}

TEST_F(Programs, ScalarParameterSumsInParts) {
  Param<float> gain("gain", 0.75f);
  Func f("f"), loss("loss");
  RDom r(0, 64, 0, 48);
  f(x, y) = cast<float>(x + 2 * y) * gain * gain;
  loss() = 0.0f;
  loss() += f(r.x, r.y);
  Derivative d = propagate_adjoints(loss);
  expect_fact(d.explanations(), Fact::Privatised, gain.name(),
              "accumulated in a fixed number of privatised copies, which are summed in order");
  double expected = 0;
  for (int j = 0; j < 48; ++j) {
    for (int i = 0; i < 64; ++i) expected += (i + 2 * j) * 1.5;
  }
  EXPECT_NEAR(evaluate_scalar(d(gain)), expected, 1e-6 * expected);
  expect_machine_code_agrees(d(gain), {{}, {}});
}

TEST_F(Programs, PrivatisedScatterIsTheSameForEveryNumberOfThreads) {
  Buffer<float> table = random_image({16}, 0.25, 2, 3),
                big = random_image({200, 100}, 0.05, 3.9, 4);
  Func f("f"), loss("loss");
  RDom r(0, 200, 0, 100);
  f(x, y) = table(clamp(cast<int>(big(x, y) * 4.0f), 0, 15)) * big(x, y);
  loss() = 0.0f;
  loss() += f(r.x, r.y) * f(r.x, r.y);
  Derivative d = propagate_adjoints(loss);
  expect_fact(d.explanations(), Fact::Privatised, table.name(),
              "accumulated in a fixed number of privatised copies, which are summed in order");
  expect_machine_code_agrees(d(table), {{0}, {16}});
}

void expect_stored_versions(const Func& loss, Buffer<float>& a) {
  EXPECT_THROW(propagate_adjoints(loss, {.overwritten = Overwritten::Refuse}), UserError);
  expect_gradient(loss, a, {.overwritten = Overwritten::Store});
  expect_gradient(loss, a);
}

TEST_F(Programs, ProductNeedsStoredVersions) {
  Func f("f");
  RDom r(0, 4);
  f(x) = 1.0f;
  f(x) *= a(x + r);
  expect_stored_versions(weighted_sum(f, {6}), a);
}

TEST_F(Programs, InPlaceSquareNeedsStoredVersions) {
  Func f("f");
  f(x) = a(x) + 1.0f;
  f(x) = f(x) * f(x) * a(x);
  f(x) += f(x) * f(x);
  expect_stored_versions(weighted_sum(f, {9}), a);
}

TEST_F(Programs, ReductionWithPredicate) {
  Func f("f");
  RDom r(0, 7, 0, 6);
  r.where(r.x + r.y < 8 && r.x >= r.y - 2);
  f(x) = 0.0f;
  f(r.x) += image(r.x, r.y) * image(r.y, r.x);
  Func loss = weighted_sum(f, {6});
  Buffer<float> square = random_image({9, 9}, 0.25, 2, 9);
  Func g("g");
  RDom q(0, 7, 0, 6);
  q.where(q.x + q.y < 8 && q.x >= q.y - 2);
  g(x) = 0.0f;
  g(q.x) += square(q.x, q.y) * square(q.y, q.x);
  Func loss2 = weighted_sum(g, {6});
  expect_gradient(loss2, square);
}

TEST_F(Programs, SeedFromBufferAndFromFunc) {
  Func f("f"), weight("weight"), loss("loss");
  f(x) = a(x) * a(x);
  Buffer<float> seed = random_image({5}, -1, 1, 11);
  seed.set_min(2);
  weight(x) = seed(x);
  RDom r(2, 5);
  loss() = 0.0f;
  loss() += f(r) * seed(r);
  Derivative by_buffer = propagate_adjoints(f, seed);
  expect_gradient(loss, by_buffer, a);
  Derivative by_func = propagate_adjoints(f, weight, {{2, 5}});
  expect_gradient(loss, by_func, a);
}

TEST_F(Programs, OnlyRequestedGradientsAreBuilt) {
  Func f("f"), g("g");
  f(x) = a(x) * 2.0f;
  g(x) = f(x) * image(x, 0);
  Func loss = weighted_sum(g, {7});
  Derivative d = propagate_adjoints(loss, {.wrt = {a}});
  EXPECT_TRUE(d(a).defined());
  EXPECT_THROW(d(image), CompileError);
  expect_fact(d.explanations(), Fact::NotRequested, image.name(),
              "no requested gradient needs its adjoint");
  expect_gradient(loss, d, a);
}

TEST_F(Programs, SecondDerivative) {
  Func f("f");
  f(x) = a(x) * a(x) * a(x);
  Func loss = weighted_sum(f, {9});
  Func gradient = propagate_adjoints(loss)(a);
  Func again = weighted_sum(gradient, {9});
  expect_gradient(again, a);
}

TEST(Gradients, TheAdjointAfterAScanIsThatOfItsConsumersOnly) {
  Buffer<float> a = random_image({5}, 0.25, 2, 1), seed = random_image({5}, -1, 1, 2);
  Func f("f");
  RDom r(1, 4);
  Var x("x");
  f(x) = a(x);
  f(r) = 0.5f * f(r - 1) + f(r);
  Derivative d = propagate_adjoints(f, seed);
  oracle::Array after = evaluate(d.adjoint(f), {{0}, {5}}), before = evaluate(d(f), {{0}, {5}});
  double expected = 0;
  for (int i = 4; i >= 0; --i) {
    expected = expected * 0.5 + static_cast<double>(seed(i));
    EXPECT_EQ(after.at({i}).scalar.as_double(), static_cast<double>(seed(i)));
    EXPECT_NEAR(before.at({i}).scalar.as_double(), expected, 1e-12);
  }
}

// The output is updated beyond the bounds that were specified, and its updates read those elements.
TEST(Gradients, ASeedIsReadInsideOfItsBoundsOnly) {
  Buffer<float> a = random_image({5}, 0.25, 2, 1), seed = random_image({4}, -1, 1, 2);
  Func f("f");
  RDom r(0, 5);
  Var x("x");
  f(x) = a(clamp(x, 0, 4));
  f(4 - r) = f(4 - r) + 0.5f * f(5 - r);
  oracle::Array found = evaluate(propagate_adjoints(f, seed)(a), {{0}, {5}});
  double expected = 0;
  for (int i = 0; i < 4; ++i) {
    expected = expected * 0.5 + static_cast<double>(seed(i));
    EXPECT_NEAR(found.at({i}).scalar.as_double(), expected, 1e-12) << i;
  }
}

}  // namespace
}  // namespace retrograde::gradient
