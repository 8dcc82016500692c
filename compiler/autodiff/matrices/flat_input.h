// flat_input.h -- views an input of several values as one with one more dimension, last, for the value.
//
//   pair(x) of 2 values        =>   pair'(x, k), k in [0, 2)
//
// Functions for arrays of numbers (jacobian.h) then work for Funcs of Tuples. Inputs of one value are not changed.
#pragma once

#include <string>
#include <vector>

#include "analysis/interval.h"
#include "autodiff/sweeps/input_shape.h"
#include "frontend/language/func.h"

namespace retrograde::autodiff {

InputShape flat(const InputShape& shape);
Box flat(Box box, const InputShape& shape);

// The flat view of a Func that has the shape of an input, such as its adjoint.
Func flat(const Func& f, const InputShape& shape);

// The direction of the input itself that corresponds to a seed of its flat shape.
Func direction(const Func& seed, const InputShape& shape);

// ---- arguments ----

std::vector<Var> variables(const std::string& base, size_t n);
std::vector<Var> both(std::vector<Var> a, const std::vector<Var>& b);
std::vector<Expr> expressions(const std::vector<Var>& vars);

}  // namespace retrograde::autodiff
