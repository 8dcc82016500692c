// pyramid.h -- halves and doubles the size of a picture: weights 1 3 3 1 along both axes, and the interpolation that
// best inverts them.
#pragma once

#include "gradient.h"

namespace programs {

inline int half(int n) { return (n + 1) / 2; }

struct Pyramid {
  std::vector<Halide::Func> stages;  // made so far

  Halide::Func smaller(Halide::Func f, std::vector<int> size, const std::string& name) {
    auto smooth = [](auto at) { return (at(-1) + 3.0f * (at(0) + at(1)) + at(2)) * 0.125f; };
    Halide::Func rows(name + "_rows"), small(name);
    rows(x, y, c) = smooth([&](int d) { return nearest(f, size, {x, 2 * y + d, c}); });
    const std::vector<int> narrow = {size[0], half(size[1]), size[2]};
    small(x, y, c) = smooth([&](int d) { return nearest(rows, narrow, {2 * x + d, y, c}); });
    stages.insert(stages.end(), {rows, small});
    return small;
  }
  Halide::Func larger(Halide::Func f, std::vector<int> size, const std::string& name) {
    Halide::Func rows(name + "_rows"), large(name);
    auto mix = [](Halide::Expr near, Halide::Expr far) { return 0.75f * near + 0.25f * far; };
    rows(x, y, c) =
        mix(nearest(f, size, {x, y / 2, c}), nearest(f, size, {x, y / 2 - 1 + 2 * (y % 2), c}));
    const std::vector<int> tall = {size[0], 2 * size[1], size[2]};
    large(x, y, c) = mix(nearest(rows, tall, {x / 2, y, c}),
                         nearest(rows, tall, {x / 2 - 1 + 2 * (x % 2), y, c}));
    stages.insert(stages.end(), {rows, large});
    return large;
  }

 private:
  Halide::Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace programs
