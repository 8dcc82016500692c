// flat_input -- an input of several values as one with one more dimension: the value, last.
//
//   pair(x) of 2 values        =>   pair'(x, k), k in [0, 2)
//
// So that what is written for arrays of numbers (jacobian.h) serves Funcs of Tuples. Everything
// here leaves inputs of one value as they are.
#pragma once

#include <string>
#include <vector>

#include "analysis/interval.h"
#include "autodiff/sweeps/input_shape.h"
#include "frontend/language/func.h"

namespace retrograde::autodiff {

InputShape flat(const InputShape& shape);
Box flat(Box box, const InputShape& shape);

// Of a Func of the shape of an input, such as its adjoint.
Func flat(const Func& f, const InputShape& shape);

// The direction of the input itself that a seed of its flat shape means.
Func direction(const Func& seed, const InputShape& shape);

// ---- arguments ----

std::vector<Var> variables(const std::string& base, size_t n);
std::vector<Var> both(std::vector<Var> a, const std::vector<Var>& b);
std::vector<Expr> expressions(const std::vector<Var>& vars);

}  // namespace retrograde::autodiff
