// Random updates of small Funcs that read and overwrite themselves at random places, affine or
// decided by data: an accepted program has a right gradient, whether values may be kept or not.
// Oracle: central differences along a random direction, in double, by the interpreter alone. The
// seed of a failure is printed and replays it.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

constexpr int size = 5;

class RandomUpdates {
 public:
  explicit RandomUpdates(unsigned seed)
      : input(random_image({size, 2}, 0.25, 1.25, seed + 7)), random_(seed) {
    is_tuple_ = pick(0, 2) == 0;
    Func f("f"), last("last");
    Expr start = input(clamp(x, 0, size - 1), clamp(y, 0, 1));
    f(x, y) = is_tuple_ ? Tuple(start, start * start) : Tuple(start * weight());
    for (int i = pick(1, 3); i > 0; --i) add_update(f);
    last(x, y) = read(f, x, y, 0) + (is_tuple_ ? read(f, x, y, 1) * 0.5f : Expr(0.0f));
    loss = weighted_sum(last, {size, 2});
  }

  Func loss;
  Buffer<float> input;

 private:
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  float weight() { return static_cast<float>(pick(-6, 6)) / 8.0f + 0.0625f; }

  Expr read(const Func& f, const Expr& u, const Expr& v, int k) {
    return is_tuple_ ? Expr(f(u, v)[k]) : Expr(f(u, v));
  }

  // A place in [0, size): affine in the iteration, or not.
  Expr place(const Expr& r, const Buffer<int>& data) {
    switch (pick(0, 9)) {
      case 0:
        return size - 1 - r;
      case 1:
        return clamp(r + pick(-2, 2), 0, size - 1);
      case 2:
        return (2 * r + pick(0, 3)) % size;
      case 3:
        return r / 2 + pick(0, 2);
      case 4:
        return Expr(pick(0, size - 1));
      case 5:
        return clamp(data(r), 0, size - 1);
      case 6:
        return select(r > 2, r - 2, r + 1);
      default:
        return r;
    }
  }

  Expr value(const Func& f, const Expr& r, const Expr& v, const Expr& self,
             const Buffer<int>& data) {
    Expr one = read(f, place(r, data), v, pick(0, is_tuple_ ? 1 : 0)),
         in = input(r, clamp(v, 0, 1));
    switch (pick(0, 8)) {
      case 0:
        return self + in * weight();
      case 1:
        return one * weight() + in;
      case 2:
        return self * weight() + one * weight();
      case 3:
        return one * in;
      case 4:
        return sin(one) * self;
      case 5:
        return select(r < pick(1, 3), self, one * 0.5f + in);
      case 6:
        return select(r == pick(0, 4), is_tuple_ ? self : undef<float>(), one + in * in);
      case 7:
        return in * weight();
      default:
        return one * one * 0.25f + self * 0.5f;
    }
  }

  void add_update(Func& f) {
    Buffer<int> data = places(size, size, random_());
    bool rows = pick(0, 2) == 0, twice = pick(0, 3) == 0;
    RDom r = twice ? RDom(0, size, 0, 2) : RDom(0, size);
    if (pick(0, 3) == 0) r.where(r.x != pick(0, size - 1));
    Expr v = rows ? Expr(pick(0, 1)) : Expr(y);
    Expr w = place(r.x, data);
    std::vector<Expr> values;
    for (int k = 0; k < (is_tuple_ ? 2 : 1); ++k)
      values.push_back(value(f, r.x, v, read(f, w, v, k), data));
    f(w, v) = Tuple(values);
  }

  std::mt19937 random_;
  bool is_tuple_ = false;
  Var x{"x"}, y{"y"};
};

double slope_along(RandomUpdates& p, const std::vector<float>& direction) {
  auto at = [&](float step) {
    auto move = [&](float by) {
      size_t i = 0;
      p.input.get()->for_each_value([&](float& v) { v += by * direction[i++]; });
    };
    move(step);
    double result = evaluate_scalar(p.loss);
    move(-step);
    return result;
  };
  auto slope = [&](float h) { return (at(h) - at(-h)) / (2.0 * h); };
  return (4 * slope(1.0f / 512) - slope(1.0f / 256)) / 3;
}

void check(unsigned seed, const AdjointOptions& options) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  RandomUpdates p(seed);
  Derivative d = propagate_adjoints(p.loss, options);
  oracle::Array found = evaluate(d(p.input), {{0, 0}, {size, 2}});
  std::vector<float> direction;
  std::mt19937 random(seed);
  double reverse = 0, scale = 1;
  for (const oracle::Value& v : found.values) {
    direction.push_back(static_cast<float>(random() % 3) - 1.0f);
    reverse += v.scalar.as_double() * direction.back();
    scale += std::abs(v.scalar.as_double());
  }
  EXPECT_NEAR(reverse, slope_along(p, direction), 1e-5 * scale) << d.explain(Detail::All);
}

constexpr unsigned programs_checked = 300;
// The updates of so many overwrite what a partial needs, which Overwritten::Refuse is there to
// refuse: 60 %, so 121 programs are differentiated. It may refuse no more.
constexpr int refused_without_versions = 179;

TEST(RandomUpdates, AreRightWhenValuesAreKeptWithinABudget) {
  for (unsigned seed = 0; seed < programs_checked / 3 && !::testing::Test::HasFailure(); ++seed)
    check(seed, {});
}

TEST(RandomUpdates, AreRightWhenValuesMayBeKept) {
  for (unsigned seed = 0; seed < programs_checked && !::testing::Test::HasFailure(); ++seed)
    check(seed, {.overwritten = Overwritten::Store});
}

// The same products, added in another order.
TEST(RandomUpdates, AreTheSameWithABudgetForStates) {
  for (unsigned seed = 0; seed < programs_checked / 2; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomUpdates p(seed);
    auto gradient = [&](std::optional<int> states) {
      Derivative d = propagate_adjoints(
          p.loss, {.overwritten = Overwritten::Store, .checkpoint_states = states});
      return evaluate(d(p.input), {{0, 0}, {size, 2}}).values;
    };
    auto expected = gradient({}), found = gradient(1 + static_cast<int>(seed % 3));
    double scale = 1;
    for (const oracle::Value& v : expected) scale += std::abs(v.scalar.as_double());
    for (size_t i = 0; i < expected.size(); ++i)
      ASSERT_NEAR(found[i].scalar.as_double(), expected[i].scalar.as_double(), 1e-12 * scale);
  }
}

TEST(RandomUpdates, AreRightOrRefusedWhenValuesMayNotBeKept) {
  int refused = 0;
  for (unsigned seed = 0; seed < programs_checked && !::testing::Test::HasFailure(); ++seed) {
    try {
      check(seed, {.overwritten = Overwritten::Refuse});
    } catch (const UserError&) {
      ++refused;
    }
  }
  EXPECT_LE(refused, refused_without_versions) << "of " << programs_checked;
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace retrograde::gradient
