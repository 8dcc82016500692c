// dialect.h -- the places where the model is written differently for Halide 14, so that its
// gradients are right and its autoscheduler does its best; the function is the same.
//
// 1. Halide inverts an index like x / 17 one at a time. In row_grid(i, o, layer(x, y), x / 17, y)
//    it replaces x by what the fourth index determines but leaves the third index at the old point,
//    and its gradient is silently wrong (apps/bilateral_slice/README.md shows it). Behind a Func
//    the division is opaque to it: it then scatters along gx, correctly.
// 2. Where it does invert (y / 13, in the grid's own gradient) it reads the photo outside its
//    bounds, at points whose contribution is zero; a boundary condition makes these reads legal.
// 3. The transforms along a row are a Func of their own for Retrograde, whose schedule keeps them
//    in a buffer of a few pixels. Li2018 would store them for the whole photo, and be slower.
// 4. Retrograde builds the gradients that are asked for; Halide builds all, and its pipeline runs
//    those that are outputs.
#pragma once

#include <vector>

#include "language.h"

namespace bilateral_slice::dialect {

#ifdef BILATERAL_SLICE_WITH_HALIDE

inline constexpr bool stage_transforms = false;

// floor(x / cell) + r, where the sum is known to lie in [0, nodes).
inline lang::Expr node(const lang::Var& x, int cell, const lang::Expr& r, int nodes) {
  lang::Func cell_of("cell_of");
  lang::Var p("p");
  cell_of(p) = p / cell;
  return lang::clamp(cell_of(x) + r, 0, nodes - 1);
}

inline lang::Func readable(const lang::ImageParam& image) {
  return lang::BoundaryConditions::repeat_edge(image);
}

inline lang::Derivative adjoints(const lang::Func& loss, const std::vector<lang::Func>&) {
  return lang::propagate_adjoints(loss);
}

#else

inline constexpr bool stage_transforms = true;

inline lang::Expr node(const lang::Var& x, int cell, const lang::Expr& r, int) {
  return x / cell + r;
}

inline lang::Func readable(const lang::ImageParam& image) { return image; }

// The gradients of `loss` by these Funcs, at least.
inline lang::Derivative adjoints(const lang::Func& loss, const std::vector<lang::Func>& by) {
  return lang::propagate_adjoints(loss, {.wrt = {by.begin(), by.end()}});
}

#endif

}  // namespace bilateral_slice::dialect
