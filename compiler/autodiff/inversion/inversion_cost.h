// inversion_cost.h -- decides whether a gather pays, or whether the access stays a scatter.
//
// The reduction domain of a gather is a box around the points that read an element. For accesses like (13 * x) % 64 + x
// / 64 the box holds far more than those points.
#pragma once

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// Returns the inversion of the query; or the scatter, with a note, if the gathers would run more than `dearer` times as
// many iterations as the stage has points. A gather may cost several times the iterations, because it is parallel and
// writes each element once. Rows in which a predicate only selects the element that is read count as one iteration. Extents that are not constant count as equal on both sides, so the gather stays.
constexpr double dearer = 32;
// The budget of the search in isl operations; a million take about half a second. Clamps with run-time ends need 10,000
// (a repeated edge) to 900,000 (three of them over sums of variables).
constexpr unsigned long worthwhile_operations = 1'000'000;
// After a search of a program was given up, the budget is halved each time, down to this minimum.
constexpr unsigned long least_operations = 125'000;
Inversion invert_or_scatter(const AccessQuery& query,
                            unsigned long operations = worthwhile_operations);

}  // namespace retrograde::autodiff
