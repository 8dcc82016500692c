// Norms, what is divided by them, and angles: scaled, so that squares neither overflow nor vanish,
// and differentiated in one step, so that nothing cancels.
#pragma once

#include <vector>

#include "autodiff/rules/stable_forms.h"
#include "ir/expr.h"

namespace retrograde::autodiff {

// Of sqrt(a * a + b * b + ...).
StableForm norm_form(const Expr& e);
// The stable form of norm * norm and pow(norm, 2), for a norm sqrt(a * a + b * b + ...) or hypot(a, b).
StableForm squared_norm_form(const Expr& e);
// Of a / norm, a / max(norm, c), a * (1 / norm), c / norm, where the norm is sqrt(a * a + b * b +
// ...) or hypot(a, b), and its reciprocal also pow(..., -0.5) or fast_inverse_sqrt(...).
StableForm normalised_form(const Expr& e);

// The components of (a_1, ..., a_n) / |(a_1, ..., a_n)|: 0 at the origin; NaN where a component is
// infinite or NaN; right to 3 ULP for denormal and huge vectors too, even where the length
// overflows.
std::vector<Expr> unit_vector(const std::vector<Expr>& a);
// The partials of atan2(y, x) by y and x: 0 at the origin and where an operand is infinite.
std::vector<Expr> angle_gradient(const Expr& y, const Expr& x);

}  // namespace retrograde::autodiff
