// chosen_terms.h -- writes out short reductions whose terms choose by the reduction variable.
//
//   lab(x, y, c) = mux(c, {116 * b(x, y) - 16, 500 * (a(x, y) - b(x, y)), 200 * (b(x, y) - d(x, y))})
//
//   b_adj(x, y) += select(c == 0, 116 * lab_adj(x, y, c), ...)    over c: 0 to 2
//   =>
//   b_adj(x, y) += 116 * lab_adj(x, y, 0) - 500 * lab_adj(x, y, 1) + 200 * lab_adj(x, y, 2)
//
// In a loop every iteration computes all alternatives, and what they share again and again.
#pragma once

#include <string>
#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// Whether the variable alone decides a choice in the term.
bool chooses_by(const Expr& term, const std::string& var);
// The term for one value of the variable, without what it does not choose.
Expr chosen_term(const Expr& term, const std::string& var, const Expr& value);

void write_out_choices(std::vector<Contribution>& contributions);

}  // namespace retrograde::autodiff
