// race_checks.h -- decides which loops over reduction variables may be reordered or run
// concurrently.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "analysis/never_meet.h"
#include "graph/function.h"

namespace retrograde::graph {

// Whether iterations of `rvar` access different elements, so that they may run concurrently: no
// iteration writes what an iteration with another value of `rvar` reads or writes, for any values
// of the other variables (analysis/never_meet.h). Variables in `around` belong to loops around it:
// only iterations that agree in them are compared. False means unknown.
//
//   u(r.x, r.t) = u(r.x - 1, r.t - 1) + u(r.x + 1, r.t - 1)     r.x: not race free, since (x, t) reads what
//                                                               (x + 1, t - 1) writes; inside of a loop over
//                                                               r.t: race free
//
// An iteration may store again the value that an element had, while others read that element, as in two colours:
//   u(r.x, r.y) = select((r.x + r.y + r.t) % 2 == 0, u(r.x - 1, r.y) + u(r.x + 1, r.y), u(r.x, r.y))
// In a kernel, such stores count as changes, and reads for an arm of a select that is not taken as reads: its threads
// promise nothing about either.
bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar,
                         const std::unordered_set<std::string>& around = {}, bool in_kernel = false,
                         analysis::ProofEffort effort = analysis::ProofEffort::Full);

// Whether loops over the reduction variables in the order `after`, instead of `before`, run every two
// iterations that access one element in the same order, if one of them writes it. Both lists hold all
// loops over reduction variables, innermost first: the variables, or what `splits` make of them. False means unknown.
bool can_prove_same_order(const FuncContents& f, const Definition& update,
                          const std::vector<std::string>& before,
                          const std::vector<std::string>& after,
                          const std::vector<Split>& splits = {});

// Whether the order of `inner + slope * outer` is that of a loop over `inner` inside of one over `outer` for every two
// iterations that access one element, if one of them writes it and both agree in the other variables. Iterations with
// equal sums then access different elements. False means unknown.
//
//   d(r.x, r.y) = f(d(r.x - 1, r.y), d(r.x, r.y - 1))       slope 1: diagonals
//   d(r.x, r.y) = f(d(r.x - 1, r.y), d(r.x + 1, r.y - 1))   slope 2
bool can_prove_skewed_order(const FuncContents& f, const Definition& update,
                            const std::string& inner, const std::string& outer, int slope);

// Whether all points of the update commute: it is f(same point) op e with an operator that is
// proven associative and commutative, for ties too. Floats are included, although reordering
// changes the rounding of their sums. False means unknown.
bool can_prove_commutative(const FuncContents& f, const Definition& update);

// Whether the update stores the same value at every point and does not read its Func, so that
// conflicting stores agree. False means unknown.
bool stores_one_value(const FuncContents& f, const Definition& update);

// A read of the Func by its update at a point that is not proven to be the written one, or one that
// the update never writes; undefined when there is none.
Expr read_of_other_element(const FuncContents& f, const Definition& update);

}  // namespace retrograde::graph
