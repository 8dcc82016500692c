// Random programs of smooth operations, quasi-affine accesses and updates. The same seed gives the
// same program.
#pragma once

#include "gradient/gradient_check.h"

namespace retrograde::gradient {

// Elements of the image in each of its two dimensions.
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
    loss() += output()(r.x, r.y) * (1.0f + 0.25f * cast<float>(r.x) - 0.125f * cast<float>(r.y));
  }

 private:
  std::mt19937 random_;
  std::vector<Func> funcs_;
  Var x{"x"}, y{"y"};

 public:
  Buffer<float> image;  // what it reads
  Func loss{"loss"};    // a weighted sum of its output
  const Func& output() const { return funcs_.back(); }

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

}  // namespace retrograde::gradient
