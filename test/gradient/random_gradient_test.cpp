// Random programs of smooth operations, quasi-affine accesses and updates: the gradient against
// central differences along a random direction, in double. The seed of a failure is printed and
// replays it.
#include "gradient/gradient_check.h"

namespace retrograde::gradient {
namespace {

constexpr int size = 5;

class RandomProgram {
 public:
  explicit RandomProgram(unsigned seed)
      : random_(seed), image(random_image({size, size}, 0.25, 1.25, seed + 100)) {
    Func base("base");
    base(x, y) = image(clamp(x, 0, size - 1), clamp(y, 0, size - 1));
    funcs_.push_back(base);
    for (int i = pick(2, 4); i > 0; --i) add_func();
    RDom r(0, size, 0, size);
    loss() = 0.0f;
    loss() +=
        funcs_.back()(r.x, r.y) * (1.0f + 0.25f * cast<float>(r.x) - 0.125f * cast<float>(r.y));
  }

 private:
  std::mt19937 random_;
  std::vector<Func> funcs_;
  Var x{"x"}, y{"y"};

 public:
  Buffer<float> image;
  Func loss{"loss"};

 private:
  int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  float weight() { return static_cast<float>(pick(-6, 6)) / 8.0f + 0.0625f; }

  // Index expressions stay in a small range, so that demand does not explode.
  Expr index(const Expr& u, const Expr& v) {
    switch (pick(0, 9)) {
      case 0:
        return u + pick(-2, 2);
      case 1:
        return u / 2 + pick(0, 1);
      case 2:
        return clamp(2 * u - pick(0, 2), 0, size - 1);
      case 3:
        return clamp(u + pick(-2, 2), 0, size - 1);
      case 4:
        return (u + pick(0, 3)) % 4;
      case 5:
        return size - 1 - u;
      case 6:
        return select(u < pick(1, 3), u + 1, u - 1);
      case 7:
        return v;
      case 8:
        return clamp(u + v, 0, size - 1);
      default:
        return u;
    }
  }
  Expr access(const Expr& u, const Expr& v) {
    const Func& f = funcs_[static_cast<size_t>(pick(0, static_cast<int>(funcs_.size()) - 1))];
    return f(index(u, v), index(v, u));
  }
  Expr value(const Expr& u, const Expr& v, int depth = 2) {
    if (depth == 0) return access(u, v);
    switch (pick(0, 6)) {
      case 0:
        return value(u, v, depth - 1) * value(u, v, depth - 1);
      case 1:
        return sin(value(u, v, depth - 1));
      case 2:
        return value(u, v, depth - 1) * weight() + 0.5f;
      case 3:
        return select(u + v < pick(2, 6), value(u, v, depth - 1),
                      value(u, v, depth - 1) * weight());
      case 4:
        return value(u, v, depth - 1) / (2.0f + cos(access(u, v)));
      case 5:
        return value(u, v, depth - 1) + cast<float>(u) * 0.125f;
      default:
        return value(u, v, depth - 1) + value(u, v, depth - 1);
    }
  }

  void add_func() {
    Func f("f");
    f(x, y) = value(x, y);
    for (int i = pick(0, 2); i > 0; --i) add_update(f);
    funcs_.push_back(f);
  }
  void add_update(Func& f) {
    switch (pick(0, 9)) {
      case 0:
        f(x, y) += value(x, y);
        break;
      case 1:
        f(pick(0, 4), y) = value(pick(0, 3), y);
        break;
      case 2:
        f(x, pick(0, 4)) += value(x, pick(0, 4));
        break;
      case 3: {
        RDom r(0, size, 0, 3);
        f(r.x, r.y + 1) += value(r.x, r.y);
        break;
      }
      case 4: {
        RDom r(0, 3);
        f(x, y) += value(x + r, y) * weight();
        break;
      }
      case 5: {
        RDom r(1, 4);
        f(x, r) = f(x, r - 1) * weight() + value(x, r);
        break;
      }
      case 6: {
        RDom r(0, 4);
        f(3 - r, y) = sin(f(4 - r, y)) + f(3 - r, y) * weight() + value(r, y) * 0.25f;
        break;
      }
      case 7: {
        RDom r(0, size, 0, size);
        r.where(r.x + r.y < 6 && r.x <= r.y + 2);
        f(r.y, r.x) += value(r.x, r.y);
        break;
      }
      case 8: {
        RDom r(0, 3);
        f(2, y) = value(r, y);
        break;
      }
      default:
        f(x, y) = f(x, y) * weight() + value(x, y);
        break;
    }
  }
};

double directional_difference(RandomProgram& p, const std::vector<float>& direction) {
  auto at = [&](float step) {
    size_t i = 0;
    p.image.get()->for_each_value([&](float& v) { v += step * direction[i++]; });
    double result = evaluate_scalar(p.loss);
    i = 0;
    p.image.get()->for_each_value([&](float& v) { v -= step * direction[i++]; });
    return result;
  };
  auto slope = [&](float h) { return (at(h) - at(-h)) / (2.0 * h); };
  return (4 * slope(1.0f / 512) - slope(1.0f / 256)) / 3;
}

TEST(RandomGradients, AgreeWithCentralDifferences) {
  int refused = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomProgram p(seed);
    std::vector<float> direction;
    std::mt19937 random(seed);
    p.image.get()->for_each_value(
        [&](float&) { direction.push_back(static_cast<float>(random() % 3) - 1.0f); });
    Func gradient;
    try {
      gradient = propagate_adjoints(p.loss, {.overwritten = Overwritten::Store})(p.image);
    } catch (const Unsupported&) {
      ++refused;
      continue;
    }
    oracle::Array found = evaluate(gradient, {{0, 0}, {size, size}});
    double reverse = 0, scale = 0;
    for (size_t i = 0; i < found.values.size(); ++i) {
      reverse += found.values[i].scalar.as_double() * direction[i];
      scale += std::abs(found.values[i].scalar.as_double());
    }
    double expected = directional_difference(p, direction);
    EXPECT_NEAR(reverse, expected, 1e-5 * (scale + 1));
  }
  EXPECT_LT(refused, 6);
}

}  // namespace
}  // namespace retrograde::gradient
