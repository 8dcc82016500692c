// coarse_values.h -- what a stage reads of a much coarser grid is interpolated along one dimension after the other.
//
//   height(x, y) = a(y) * (u(x) * g(x / n, y / n) + v(x) * g(x / n + 1, y / n))
//                + b(y) * (u(x) * g(x / n, y / n + 1) + v(x) * g(x / n + 1, y / n + 1))
//   =>  height_rows(x, y) = u(x) * g(x / n, y) + v(x) * g(x / n + 1, y)
//       height(x, y) = a(y) * height_rows(x, y / n) + b(y) * height_rows(x, y / n + 1)
//
// The Func has a row for each row of the grid, not for each of the stage. Each of its elements is computed once, where
// the definition computes it n times, and an element of the stage takes as many terms as the grid has along y, not the
// product over all dimensions. The adjoint of the grid gains most: it is a sum down columns, by vectors, and then a short
// sum along rows. Without the Func, each element of the grid adds all elements of the stage that read it.
//
// 1. The Func is the user's and has no directives. Its stage has no predicate.
// 2. The value depends on a variable through one index of the grid, to which at least three elements of the stage belong
//    on average (coarse_axis.h), and on another variable. It has two reads of one grid, or is a sum over some of the
//    stage's reduction variables.
// 3. It has no effect, and does not lie in an arm of an if_then_else.
// 4. Sizes are known, and the operations saved are many.
//
// A value within a definition keeps its bits. If sums may be reordered, terms with common factors are added first and
// sums over reduction domains are split (separable_sums.h); the program that is differentiated is rewritten so, because
// only derivatives then depend on the order.
//
// Not done: grids at data-dependent indices; sizes known at run time only; tangents.
// Source: folklore; "sum factorisation" of tensor products, S. Orszag, Spectral methods for problems in complex
// geometries, Journal of Computational Physics 37 (1980).
#pragma once

#include <vector>

#include "ir/interval.h"
#include "ir/visit.h"
#include "transform/factored_graph.h"

namespace retrograde::transform {

// The range of a pure variable in a stage of the graph.
using RangeOfVariable =
    FunctionRef<Interval(const FuncContents& f, int stage, const std::string& variable)>;

// `outputs`: of a graph whose wrappers have been applied.
FactoredGraph hoist_coarse_values(const std::vector<FuncPtr>& outputs, RangeOfVariable range,
                                  SumOrder order);

}  // namespace retrograde::transform
