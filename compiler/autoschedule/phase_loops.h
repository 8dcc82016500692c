// phase_loops.h -- stages that divide by a stride along their first dimension, in vectors of one phase.
//
//   f(t) += in(2 * t / 3 - r) * taps(2 * t % 3 + 3 * r)
//
//   for t by 16:                                  for t by 48:
//     for r:                                        for r:
//       for ti of 16 lanes:                 =>        for phase < 3 (unrolled):
//         gathers of `in` and of `taps`                 for ti of 16 lanes: in(strided), taps(one element)
//
// Lanes that are the period of all divisions apart (analysis/periods.h) have the same remainder, and quotients that
// grow by the same number from lane to lane. Sums stay in registers, and the phases of a vector are stored together
// (lower/interleave_vectors). A pure stage needs this only if the period does not divide a vector, whose lanes are split
// there otherwise.
#pragma once

#include <cstdint>

#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// The period of what a stage reads along a dimension, through Funcs that are computed inline too; 1: none.
int64_t period_of_reads(const FuncContents& f, const Definition& stage, size_t dimension);

// Whether vectors of `lanes` elements are no multiple of the period along the first dimension, if that is short.
bool has_odd_phases(const FuncContents& f, const Definition& stage, int lanes);

// Gives a stage vectors of `lanes` elements of one phase along its first dimension; false: it has no phases, too many, or
// too few elements.
bool split_into_phases(const FuncContents& f, int index, Stage stage, int lanes,
                       const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
