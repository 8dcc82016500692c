// choices.h -- dimensions of few values that choose what is computed: a copy of the body for each.
//
//   sites(x, y, c) = mux(c, {a(x, y), b(x, y), a(x, y) + b(x, y)})        c: 0 to 2
//
//   for c, y, x:                           for y, x:
//     sites = c == 0 ? a : ...       =>      sites(.., 0) = a
//                                            sites(.., 1) = b
//                                            sites(.., 2) = a + b
//
// A choice that a loop decides computes all of its alternatives; in a copy of the body it is gone, and
// what several copies read is read once. What only the copies read is computed beside them.
#pragma once

#include <vector>

#include "autoschedule/fixed_dimensions.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Of a pure Func, those by which its values choose; with what is inlined into them, or without.
enum class ChoicesOf : uint8_t { ItsOwn, WithInlined };
std::vector<size_t> chosen_dimensions(const FuncContents& f, const FixedDimensions& fixed,
                                      ChoicesOf whose);

// Of those of the Funcs, all of which this scheduler has given loops, that run along rows.
void unroll_choices(const std::vector<FuncPtr>& given, const FixedDimensions& fixed,
                    const SizeEstimate& sizes);
// Where each of the copies reads the same element, and nobody else does: a vector at a time.
void compute_beside_choices(const Readers& readers, const std::vector<FuncPtr>& given,
                            const std::unordered_set<const Symbol*>& but);

}  // namespace retrograde::autoschedule
