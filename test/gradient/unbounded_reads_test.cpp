// Tests gradients through Funcs that are read at indices which depend on data and have no bounds, as the boundary
// condition of a warp is: the contributions pass to what these Funcs read.
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

using Bound = Func (*)(const Func&, const Region&);
Func with_constant(const Func& f, const Region& region) {
  return BoundaryConditions::constant_exterior(f, 0.75f, region);
}
Func repeated(const Func& f, const Region& r) { return BoundaryConditions::repeat_edge(f, r); }
Func periodic(const Func& f, const Region& r) { return BoundaryConditions::repeat_image(f, r); }
Func mirrored(const Func& f, const Region& r) { return BoundaryConditions::mirror_image(f, r); }
Func reflected(const Func& f, const Region& r) { return BoundaryConditions::mirror_interior(f, r); }

class UnboundedReads : public ::testing::Test {
 protected:
  static constexpr int n = 6;
  Var x{"x"}, y{"y"};
  Buffer<float> image = random_image({n, n}, -1, 1, 5), flow = random_image({n, n}, -4, 4, 6);
  const Region all{{0, n}, {0, n}};

  // f, linearly interpolated at a place that the flow moves by up to four elements, also outside of the image.
  Func warped(const Func& f) const {
    Func result("warped");
    const Expr u = x + flow(x, y), i = cast<int>(floor(u));
    result(x, y) = lerp(f(i, y), f(i + 1, y), u - i);
    return result;
  }
  void expect_right(const Func& f) {
    const Func loss = weighted_sum(f, {n, n});
    const Derivative d = propagate_adjoints(loss);
    expect_gradient(loss, d, image);
    expect_gradient(loss, d, flow);
  }
};

class BoundaryConditionOfAWarp : public UnboundedReads,
                                 public ::testing::WithParamInterface<Bound> {};

TEST_P(BoundaryConditionOfAWarp, OfAnImage) {
  Func identity("identity");
  identity(x, y) = image(x, y);
  expect_right(warped(GetParam()(identity, all)));
}

TEST_P(BoundaryConditionOfAWarp, OfAComputedFunc) {
  Func squares("squares");
  squares(x, y) = image(x, y) * image(x, y);
  expect_right(warped(GetParam()(squares, all)));
}

INSTANTIATE_TEST_SUITE_P(Conditions, BoundaryConditionOfAWarp,
                         ::testing::Values(with_constant, repeated, periodic, mirrored, reflected));

TEST_F(UnboundedReads, PassThroughSeveralFuncs) {
  Func bounded = repeated(Func(image), all), smooth("smooth");
  smooth(x, y) = 0.25f * bounded(x - 1, y) + bounded(x, y) * bounded(x, y + 1);
  expect_right(warped(smooth));
}

TEST_F(UnboundedReads, BesideBoundedOnes) {
  Func bounded = repeated(Func(image), all), moved = warped(bounded), both("both");
  both(x, y) = moved(x, y) * bounded(x - 2, y) + bounded(x, y + 1);
  expect_right(both);
}

TEST_F(UnboundedReads, InUpdates) {
  Func bounded = with_constant(Func(image), all), sums("sums");
  RDom r(0, 3);
  sums(x, y) = 0.0f;
  sums(x, y) += bounded(x + cast<int>(floor(flow(x, y))) + r, y) * flow(x, y);
  expect_right(sums);
}

// The one element that a stage of one point reads: its place is known to be inside of the image by a promise only.
TEST_F(UnboundedReads, AtAPromisedIndexOfOneElement) {
  constexpr int size = 9;
  Buffer<float> line = random_image({size}, -1, 1, 5);
  Buffer<int> indices({1}, "indices");
  indices(0) = 4;
  Func out("out");
  out(x) = line(unsafe_promise_clamped(indices(x), 0, size - 1)) * 0.75f;
  const Func loss = weighted_sum(out, {1});
  expect_gradient(loss, propagate_adjoints(loss), line);
}

TEST_F(UnboundedReads, LeaveTheirFuncWithoutAnAdjoint) {
  const Func bounded = repeated(Func(image), all);
  const Derivative d = propagate_adjoints(weighted_sum(warped(bounded), {n, n}));
  expect_error({"find the gradient by \"repeat_edge", "its adjoint has no size"},
               [&] { d(bounded); });
}

TEST_F(UnboundedReads, OfFuncsWithUpdatesAreNamedInTheError) {
  Func counts("unbounded_counts"), read("read");
  RDom r(0, n, 0, n);
  counts(x) = 0.0f;
  counts(clamp(cast<int>(flow(r.x, r.y)), 0, 3)) += image(r.x, r.y);
  read(x, y) = counts(cast<int>(flow(x, y)));
  const Derivative d = propagate_adjoints(weighted_sum(read, {n, n}));
  expect_error({"cannot compute", "\"unbounded_counts\"", "Clamp the index that depends on data"},
               [&] {
                 d(image).realize({n, n});
               });
}

}  // namespace
}  // namespace retrograde::gradient
