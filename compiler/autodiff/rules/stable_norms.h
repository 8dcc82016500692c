// stable_norms.h -- derivatives of norms, normalised vectors and angles.
//
// Vectors are scaled first, so that squares neither overflow nor underflow. Each form is differentiated in one step, so
// that nothing cancels.
#pragma once

#include <vector>

#include "autodiff/rules/stable_forms.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// The stable form of sqrt(a * a + b * b + ...).
StableForm norm_form(const Expr& e);
// The stable form of norm * norm and pow(norm, 2), for a norm sqrt(a * a + b * b + ...) or hypot(a, b).
StableForm squared_norm_form(const Expr& e);
// The stable form of a / norm, a / max(norm, c), a * (1 / norm) and c / norm. The norm is sqrt(a * a + b * b + ...) or
// hypot(a, b); its reciprocal may also be pow(..., -0.5) or fast_inverse_sqrt(...).
StableForm normalised_form(const Expr& e);

// The components of (a_1, ..., a_n) / |(a_1, ..., a_n)|: 0 at the origin, NaN where a component is infinite or NaN. The
// error is at most 3 ULP, also for denormal and huge vectors whose length overflows.
std::vector<Expr> unit_vector(const std::vector<Expr>& a);
// The partials of atan2(y, x) by y and x: 0 at the origin and where an operand is infinite.
std::vector<Expr> angle_gradient(const Expr& y, const Expr& x);

}  // namespace retrograde::autodiff
