// When a gather is not worth it: its reduction domain is a box around the points that read an
// element, and for accesses like (13 * x) % 64 + x / 64 the box holds far more than those points.
#pragma once

#include "autodiff/inversion/access_inversion.h"

namespace retrograde::autodiff {

// The inversion of the query, or the scatter where the gathers would run more than `dearer` times
// as many iterations as the stage has points; `note` says so. A gather is parallel and writes each
// element once, so it may cost several times as many iterations. Extents that are no constants
// count as equal on both sides: then the gather stays.
constexpr double dearer = 32;
// Nor may the search for it take long: a million operations are about half a second. Clamps with
// run-time ends need 10,000 (a repeated edge) to 900,000 (three of them over sums of variables).
constexpr unsigned long worthwhile_operations = 1'000'000;
// Once searches of a program have been given up, the next may take half as many each time, down to
// this.
constexpr unsigned long least_operations = 125'000;
Inversion invert_or_scatter(const AccessQuery& query,
                            unsigned long operations = worthwhile_operations);

}  // namespace retrograde::autodiff
