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
#include <optional>
#include <string>

#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// The period of what a stage reads along a dimension, through Funcs that are computed inline too; 1: none.
int64_t period_of_reads(const FuncContents& f, const Definition& stage, size_t dimension);

// By how much an index, but for clamps, grows when the variable grows by the period; nullopt: not always by the same.
std::optional<int64_t> growth_of_index(const Expr& index, const std::string& variable,
                                       int64_t period);

// The phases that a tile of sums has along its first dimension; 1: none. Vectors of one phase are dense in all that the
// stage reads, or read one element. Lanes of elements that lie together would divide:
//
//   f(x, c) += in(x / 2 - r) * w(x % 2 + 2 * r, c)
int64_t phases_of_tile(const FuncContents& f, const Definition& stage, int lanes,
                       const SizeEstimate& sizes);

// Whether vectors of `lanes` elements are no multiple of the period along the first dimension, if that is short.
bool has_odd_phases(const FuncContents& f, const Definition& stage, int lanes);

// Gives a stage vectors of `lanes` elements of one phase along its first dimension; false: it has no phases, too many, or
// too few elements.
bool split_into_phases(const FuncContents& f, int index, Stage stage, int lanes,
                       const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
