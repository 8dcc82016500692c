// Tests gathers of a stencil over an adjoint that is zero outside of its box: they need no conditions for that.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <cmath>
#include <limits>

#include "graph/graph.h"
#include "ir/build.h"

namespace retrograde {
namespace {

struct Stencil {
  static constexpr int width = 37, taps = 5, channels = 3;
  Stencil() {
    for (int i = 0; i < width + taps - 1; i++) {
      for (int k = 0; k < channels; k++) image(i, k) = static_cast<float>((i * 7 + k) % 5) - 2.0f;
    }
    for (int i = 0; i < taps; i++) {
      for (int k = 0; k < channels; k++) weights(i, k) = static_cast<float>((i * 3 + k) % 4) - 1.5f;
    }
    for (int i = 0; i < width; i++) seed(i) = static_cast<float>((i * 5) % 7) - 3.0f;
    RDom r(0, taps, 0, channels, "r");
    out(x) = 0.0f;
    out(x) += image(x + r.x, r.y) * weights(r.x, r.y);
  }
  Func gradient() { return propagate_adjoints(out, Func(seed), {{0, width}})(image); }
  // The expected gradient by the image, summed term by term.
  float expected(int i, int k) const {
    float sum = 0;
    for (int tap = 0; tap < taps; tap++) {
      if (i - tap >= 0 && i - tap < width) sum += seed(i - tap) * weights(tap, k);
    }
    return sum;
  }
  Var x{"x"};
  Buffer<float> image{width + taps - 1, channels}, weights{taps, channels}, seed{width};
  Func out{"out"};
};

// The conditions of the update that sums the gradient.
std::vector<Expr> conditions_of(const Func& gradient) {
  std::vector<Expr> result;
  for (const graph::FuncPtr& f : graph::topological_order({gradient.function()})) {
    for (const graph::Definition& update : f->updates) add_conjuncts(update.predicate, result);
  }
  return result;
}
bool depends_on_a_tap(const Expr& condition) {
  return any_node(condition,
                  [](const ir::Variable& v) { return v.name.find("rho") != std::string::npos; });
}

TEST(ZeroBorders, HaveNoConditions) {
  Stencil stencil;
  const Func gradient = stencil.gradient();
  for (const Expr& condition : conditions_of(gradient))
    EXPECT_FALSE(depends_on_a_tap(condition)) << condition;
}

TEST(ZeroBorders, LeaveTheGradientAsItIs) {
  for (const bool is_scheduled : {false, true}) {
    Stencil stencil;
    Func gradient = stencil.gradient();
    if (is_scheduled) {
      gradient.set_estimates({{0, Stencil::width + Stencil::taps - 1}, {0, Stencil::channels}});
      Pipeline(gradient).auto_schedule(get_host_target());
    }
    const Buffer<float> found =
        gradient.realize({Stencil::width + Stencil::taps - 1, Stencil::channels});
    for (int i = 0; i < Stencil::width + Stencil::taps - 1; i++) {
      for (int k = 0; k < Stencil::channels; k++)
        EXPECT_FLOAT_EQ(found(i, k), stencil.expected(i, k)) << i << ", " << k;
    }
  }
}

// The second tap, whose weight is infinite, does not read the first element.
TEST(ZeroBorders, StayZeroBesideInfinity) {
  Stencil stencil;
  for (int k = 0; k < Stencil::channels; k++)
    stencil.weights(1, k) = std::numeric_limits<float>::infinity();
  const Buffer<float> found =
      stencil.gradient().realize({Stencil::width + Stencil::taps - 1, Stencil::channels});
  const int last = Stencil::width + Stencil::taps - 2;
  for (int k = 0; k < Stencil::channels; k++) {
    EXPECT_FLOAT_EQ(found(0, k), stencil.seed(0) * stencil.weights(0, k));
    EXPECT_FLOAT_EQ(found(last, k),
                    stencil.seed(Stencil::width - 1) * stencil.weights(Stencil::taps - 1, k));
    EXPECT_TRUE(std::isinf(found(1, k)));
  }
}

// A factor with an index of its own is read only inside of the domain, because its image ends there.
TEST(ZeroBorders, ReadOtherFactorsInsideOfTheirImages) {
  Stencil stencil;
  Buffer<float> gains(Stencil::width);
  for (int i = 0; i < Stencil::width; i++) gains(i) = static_cast<float>(i % 3) + 0.5f;
  RDom r(0, Stencil::taps, "r");
  Func weighted("weighted");
  weighted(stencil.x) = 0.0f;
  weighted(stencil.x) += stencil.image(stencil.x + r, 0) * gains(stencil.x);
  const Buffer<float> found =
      propagate_adjoints(weighted, Func(stencil.seed), {{0, Stencil::width}})(stencil.image)
          .realize({Stencil::width + Stencil::taps - 1, 1});
  for (int i = 0; i < Stencil::width + Stencil::taps - 1; i++) {
    float sum = 0;
    for (int tap = 0; tap < Stencil::taps; tap++) {
      const int at = i - tap;
      if (at >= 0 && at < Stencil::width) sum += stencil.seed(at) * gains(at);
    }
    EXPECT_FLOAT_EQ(found(i, 0), sum) << i;
  }
}

// up(x) = sum of image((x + 2) / 4 - tap) * weights((x + 2) % 4 + 4 * tap): a transposed convolution of stride 4. In
// planes: the same along x and y.
struct Upsampled {
  static constexpr int width = 61, stride = 4, taps = 2;
  Upsampled() {
    for (int i = 0; i < width; i++) image(i) = static_cast<float>((i * 7) % 5) - 2.0f;
    for (int i = 0; i < stride * taps; i++) weights(i) = static_cast<float>((i * 3) % 4) - 1.5f;
    for (int i = 0; i < stride * width; i++) seed(i) = static_cast<float>((i * 5) % 7) - 3.0f;
    const Func padded = BoundaryConditions::constant_exterior(image, 0.0f, {{0, width}});
    const RDom r(0, taps, "r");
    up(x) = 0.0f;
    up(x) += padded((x + 2) / stride - r) * weights((x + 2) % stride + stride * r);
  }
  Func gradient() { return propagate_adjoints(up, Func(seed), {{0, stride * width}})(image); }
  // Separable weights are added up along one dimension after the other.
  Func gradient_of_plane(bool is_separable) {
    plane.fill(1.0f);
    const Func padded =
        BoundaryConditions::constant_exterior(plane, 0.0f, {{0, width}, {0, width}});
    const RDom r(0, taps, 0, taps, "r");
    Func of_plane("of_plane"), seeds("seeds");
    const Expr across = weights((x + 2) % stride + stride * r.x),
               down = weights((y + 2) % stride + stride * r.y);
    of_plane(x, y) = 0.0f;
    of_plane(x, y) += padded((x + 2) / stride - r.x, (y + 2) / stride - r.y) *
                      (is_separable ? across * down : across + down);
    seeds(x, y) = seed(clamp(x, 0, seed.width() - 1)) * seed(clamp(y, 0, seed.width() - 1));
    return propagate_adjoints(of_plane, seeds, {{0, stride * width}, {0, stride * width}})(plane);
  }
  float expected(int i) const {
    float sum = 0;
    for (int k = 0; k < stride; k++) {
      for (int tap = 0; tap < taps; tap++) {
        const int at = stride * (i + tap) + k - 2;
        if (at >= 0 && at < stride * width) sum += seed(at) * weights(k + stride * tap);
      }
    }
    return sum;
  }
  Var x{"x"}, y{"y"};
  Buffer<float> plane{width, width};
  Buffer<float> image{width}, weights{stride * taps}, seed{stride * width};
  Func up{"up"};
};

// A clamped place would have other remainders in the lanes at a border.
TEST(ZeroBorders, LeaveNoRemainders) {
  Upsampled sum;
  for (const Func& gradient : {sum.gradient(), sum.gradient_of_plane(false)}) {
    for (const graph::FuncPtr& f : graph::topological_order({gradient.function()})) {
      for (const graph::Definition& update : f->updates) {
        for (const Expr& value : update.values) {
          EXPECT_FALSE(any_node(value, [](const ir::Mod&) { return true; })) << value;
          EXPECT_FALSE(any_node(value, [](const ir::Select&) { return true; })) << value;
        }
      }
    }
  }
}

TEST(ZeroBorders, LeaveTheGradientOfStridesAsItIs) {
  for (const bool is_scheduled : {false, true}) {
    Upsampled sum;
    Func gradient = sum.gradient();
    if (is_scheduled) {
      gradient.set_estimates({{0, Upsampled::width}});
      Pipeline(gradient).auto_schedule(get_host_target());
    }
    const Buffer<float> found = gradient.realize({Upsampled::width});
    for (int i = 0; i < Upsampled::width; i++) EXPECT_FLOAT_EQ(found(i), sum.expected(i)) << i;
    const Buffer<float> plane =
        sum.gradient_of_plane(true).realize({Upsampled::width, Upsampled::width});
    for (const int j : {0, 1, 30, 60}) {
      for (int i = 0; i < Upsampled::width; i++)
        EXPECT_NEAR(plane(i, j), sum.expected(i) * sum.expected(j), 1e-2) << i << ", " << j;
    }
  }
}

}  // namespace
}  // namespace retrograde
