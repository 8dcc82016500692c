// dialect.h -- adapts the model to Halide 14, so that its gradients are right and its autoscheduler does well. The
// function that the model computes stays the same.
//
// 1. Halide inverts an index like x / 17 one at a time. In row_grid(i, o, layer(x, y), x / 17, y)
//    it replaces x by what the fourth index determines but keeps the old x in the third index,
//    and its gradient is silently wrong (apps/bilateral_slice/README.md shows it). A Func around
//    the division hides it from Halide, which then scatters along gx, correctly.
// 2. Where it does invert (y / 13, in the grid's own gradient) it reads the photo out of bounds,
//    at points whose contribution is zero; a boundary condition makes these reads legal.
// 3. For Retrograde, the transforms along a row are a Func, which its schedule keeps in a buffer of
//    a few pixels. Li2018 would store that Func for the whole photo, which is slower.
// 4. Retrograde builds only the requested gradients; Halide builds all of them, and its pipeline
//    runs those that are outputs.
#pragma once

#include <vector>

#include "language.h"

namespace bilateral_slice::dialect {

#ifdef BILATERAL_SLICE_WITH_HALIDE

inline constexpr bool stage_transforms = false;

// floor(x / cell) + r; the sum is known to lie in [0, nodes).
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

// The gradients of `loss` with respect to at least these Funcs.
inline lang::Derivative adjoints(const lang::Func& loss, const std::vector<lang::Func>& by) {
  return lang::propagate_adjoints(loss, {.wrt = {by.begin(), by.end()}});
}

#endif

}  // namespace bilateral_slice::dialect
