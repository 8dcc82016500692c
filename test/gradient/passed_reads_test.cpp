// Tests adjoints of stencils over boundary conditions: they are stencils again, with the right values. Also tests the
// cases in which a boundary condition keeps an adjoint of its own in between.
#include "autodiff/borders/passed_reads.h"

#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "gradient/gradient_check.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

using Bound = Func (*)(const Func&, const Region&);

// The gradient by `image` of repeated stencil steps over states with boundary conditions.
struct Stencil {
  Buffer<float> image;
  Func state{"state"}, bounded, next{"next"}, loss;

  // A stencil with taps at these offsets beside the element itself, in two dimensions.
  Stencil(Bound bound, const std::vector<std::pair<int, int>>& taps)
      : image(random_image({12, 10}, -1.0, 1.0, 7)) {
    state(x, y) = image(x, y) * image(x, y);
    bounded = bound(state, {{0, 12}, {0, 10}});
    Expr sum = 0.25f * state(x, y);
    float factor = 0.5f;
    for (const auto& [dx, dy] : taps) sum += (factor += 0.25f) * bounded(x + dx, y + dy);
    next(x, y) = sum * image(x, y);
    loss = weighted_sum(next, {12, 10});
  }
  void expect_right() {
    Func gradient = propagate_adjoints(loss)(image);
    const Buffer<float> found = gradient.realize({12, 10});
    for (int py = 0; py < 10; ++py) {
      for (int px = 0; px < 12; ++px)
        EXPECT_NEAR(found(px, py), difference(loss, image, {px, py}), 2e-3) << px << ", " << py;
    }
  }
  int updates() { return propagate_adjoints(loss)(state).num_update_definitions(); }
};

const std::vector<std::pair<int, int>> cross{{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
const std::vector<std::pair<int, int>> block{{-1, -1}, {0, -1}, {1, -1}, {-1, 0},
                                             {1, 0},   {-1, 1}, {0, 1},  {1, 1}};

TEST(PassedReads, AnEvenStencilOverClampedPlacesHasAStencilAsItsAdjoint) {
  Buffer<float> image = random_image({9, 10, 11}, -1.0, 1.0, 3);
  Func state("state"), next("next");
  state(x, y, z) = 2.0f * image(x, y, z);
  const Func f = BoundaryConditions::repeat_edge(state, {{0, 9}, {0, 10}, {0, 11}});
  next(x, y, z) = f(x - 1, y, z) + f(x + 1, y, z) + f(x, y - 1, z) + f(x, y + 1, z) +
                  f(x, y, z - 1) + f(x, y, z + 1);
  const Func loss = weighted_sum(next, {9, 10, 11});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(d(state).num_update_definitions(), 0);
  const Buffer<float> found = d(image).realize({9, 10, 11});
  for (int pz : {0, 1, 5, 10}) {
    for (int py : {0, 3, 9}) {
      for (int px : {0, 4, 8})
        EXPECT_NEAR(found(px, py, pz), difference(loss, image, {px, py, pz}), 5e-3);
    }
  }
}

TEST(PassedReads, CornersOfABlockJoinItsSides) {
  Buffer<float> image = random_image({12, 10}, -1.0, 1.0, 9);
  Func state("state"), next("next");
  state(x, y) = image(x, y) * image(x, y);
  const Func f = BoundaryConditions::repeat_edge(state, {{0, 12}, {0, 10}});
  Expr sum = f(x, y);
  for (const auto& [dx, dy] : block) sum += f(x + dx, y + dy);
  next(x, y) = sum / 9.0f;
  const Func loss = weighted_sum(next, {12, 10});
  const Derivative d = propagate_adjoints(loss);
  EXPECT_EQ(d(state).num_update_definitions(), 0);
  const Buffer<float> found = d(image).realize({12, 10});
  for (int py = 0; py < 10; ++py) {
    for (int px = 0; px < 12; ++px)
      EXPECT_NEAR(found(px, py), difference(loss, image, {px, py}), 2e-3);
  }
}

TEST(PassedReads, UnevenWeightsLeaveUpdatesOfTheSidesAlone) {
  Stencil stencil(BoundaryConditions::repeat_edge, cross);
  EXPECT_EQ(stencil.updates(), 4);  // a side each, and no corner
  stencil.expect_right();
  Stencil(BoundaryConditions::repeat_edge, block).expect_right();
}

TEST(PassedReads, OtherBoundaryConditionsAreRight) {
  for (const Bound bound : std::initializer_list<Bound>{BoundaryConditions::repeat_image,
                                                        BoundaryConditions::mirror_image,
                                                        BoundaryConditions::mirror_interior}) {
    Stencil(bound, cross).expect_right();
    Stencil(bound, block).expect_right();
  }
}

TEST(PassedReads, AConstantOutsideLeavesAStencilWithoutUpdates) {
  Stencil stencil(
      [](const Func& f, const Region& region) {
        return BoundaryConditions::constant_exterior(f, 0.5f, region);
      },
      cross);
  EXPECT_EQ(stencil.updates(), 0);
  stencil.expect_right();
}

TEST(PassedReads, GoThroughSeveralFuncsThatOnlyLookUp) {
  Stencil stencil(
      [](const Func& f, const Region& region) {
        Func moved("moved");
        moved(x, y) = BoundaryConditions::repeat_edge(f, region)(x + 1, y - 1);
        return moved;
      },
      cross);
  stencil.expect_right();
}

TEST(PassedReads, FarTapsAndWindowsGoByTheAdjointOfTheBoundary) {
  Stencil stencil(BoundaryConditions::repeat_edge, {{-3, 0}, {2, 1}, {0, 4}});
  stencil.expect_right();
  RDom r(-2, 5, -1, 3);
  stencil.next = Func("window");
  stencil.next(x, y) = 0.0f;
  stencil.next(x, y) += stencil.bounded(x + r.x, y + r.y) * stencil.image(x, y);
  stencil.loss = weighted_sum(stencil.next, {12, 10});
  stencil.expect_right();
}

TEST(PassedReads, TheBoundaryItselfStillHasItsAdjoint) {
  Stencil stencil(BoundaryConditions::repeat_edge, cross);
  Func all = propagate_adjoints(stencil.loss)(stencil.bounded);
  AdjointOptions only;
  only.wrt = {stencil.bounded, stencil.image};
  const Derivative wanted = propagate_adjoints(stencil.loss, only);
  const Buffer<float> found = all.realize({12, 10}),
                      alone = wanted(stencil.bounded).realize({12, 10});
  for (int py = 0; py < 10; ++py) {
    for (int px = 0; px < 12; ++px) EXPECT_EQ(found(px, py), alone(px, py));
  }
  EXPECT_GT(std::abs(found(3, 2)), 0.1f);
}

TEST(PassedReads, OnlyFuncsThatReadOneElementLookUp) {
  Func f("f"), twice("twice"), scaled("scaled"), placed("placed");
  f(x) = cast<float>(x);
  twice(x) = f(x) + f(x + 1);
  scaled(x) = 2.0f * f(x);
  placed(x) = f(cast<int>(f(x)));
  Func plane("plane"), diagonal("diagonal"), slice("slice"), turned("turned");
  plane(x, y) = cast<float>(x - y);
  diagonal(x) = plane(x, x);
  slice(x) = plane(x, 2);
  turned(x, y) = plane(y, -x);
  EXPECT_TRUE(autodiff::is_look_up(*turned.function()));
  for (const Func& other : {f, twice, scaled, placed, diagonal, slice})
    EXPECT_FALSE(autodiff::is_look_up(*other.function())) << other.name();
  EXPECT_TRUE(autodiff::is_look_up(*BoundaryConditions::repeat_edge(f, {{0, 4}}).function()));
  EXPECT_TRUE(
      autodiff::is_look_up(*BoundaryConditions::constant_exterior(f, 1.0f, {{0, 4}}).function()));
}

// ---- Funcs with zeros between the elements of another one ----

// A transposed convolution: image -> padded -> spread -> out.
struct Transposed {
  int stride, taps;
  Buffer<float> image = random_image({9}, -1.0, 1.0, 5);
  Buffer<float> kernel = random_image({taps}, -1.0, 1.0, 6);
  Func spread{"spread"}, out{"out"};
  Func loss = define();

  Func define() {
    Func source("source");
    source(x) = image(x) * image(x);
    const Func padded = BoundaryConditions::constant_exterior(source, 0.0f, {{0, 9}});
    spread(x) = select(x % stride == 0, padded(x / stride), 0.0f);
    RDom r(0, taps);
    out(x) = 0.0f;
    out(x) += spread(x + 1 - r) * kernel(r);
    return weighted_sum(out, {9 * stride});
  }
};

bool reads(const Func& gradient, const std::string& name) {
  const auto order = graph::topological_order({gradient.function()});
  return std::ranges::any_of(
      order, [&](const graph::FuncPtr& f) { return f->name.substr(0, f->name.find('$')) == name; });
}

// Iterations of all updates of the adjoints that a gradient is computed from, for each element.
int64_t iterations_of(const Func& gradient) {
  int64_t result = 0;
  for (const graph::FuncPtr& f : graph::topological_order({gradient.function()})) {
    if (!f->made) continue;
    for (const graph::Definition& update : f->updates) {
      int64_t iterations = 1;
      for (const graph::ReductionVariable& r : update.rvars)
        iterations *= ir::as_const_int(r.extent).value_or(1000);
      result += iterations;
    }
  }
  return result;
}

TEST(PassedReads, GradientsOfTransposedConvolutionsAreRight) {
  for (const int stride : {2, 3}) {
    for (const int taps : {1, 3, 4, 7}) {
      Transposed program{stride, taps};
      const Derivative d = propagate_adjoints(program.loss);
      expect_gradient(program.loss, d, program.image);
      expect_gradient(program.loss, d, program.kernel);
    }
  }
}

TEST(PassedReads, ZerosBetweenElementsNeedNoAdjoint) {
  Transposed program{2, 4};
  const Derivative d = propagate_adjoints(program.loss);
  EXPECT_FALSE(reads(d(program.image), "spread_adj"));
  EXPECT_TRUE(d(program.spread).defined());
}

TEST(PassedReads, ZerosBetweenElementsAreNoTermsOfTheKernel) {
  Transposed program{3, 4};
  const Derivative d = propagate_adjoints(program.loss);
  EXPECT_LE(iterations_of(d(program.kernel)), 9 + 1);  // not 27
}

}  // namespace
}  // namespace retrograde::gradient
