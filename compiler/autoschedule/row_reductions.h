// row_reductions.h -- reductions along rows of what they read, in vectors of terms instead of vectors of elements.
//
//   total(y) += exp(in(r, y))     =>     parallel for y:
//                                          partial[0..31] = 0
//                                          for r in steps of 32: partial[0..31] += exp(in(r .. r + 31, y))
//                                          total(y) += sum of partial[0..31]
//
// Neighbouring elements of `total` read places that are a row apart: a vector of elements gathers each lane from another
// cache line, where a vector of terms is one load. The partial results stay in registers over all loops of the
// reduction. Several vectors of one row hide the latency of the addition.
//
// Long sums of floats are added in blocks (long_sums.h), each of which has its own partial results. Lanes of a block are
// added in pairs.
//
// The values of a Tuple, such as an extreme and its place, have partial results for each lane, which are combined one
// after the other.
//
// Lanes and blocks depend on the program and the target alone, so results have the same bits for every number of
// threads.
#pragma once

#include <optional>
#include <string>

#include "autoschedule/register_tile.h"
#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct RowReduction {
  std::string loop;       // the reduction variable that runs along the rows
  int lanes = 0;          // of its vectors
  bool is_short = false;  // all elements together take less time than it takes to start threads
};

// nullopt: vectors of elements take about as long, or the update is neither a sum, product, minimum or maximum nor a
// Tuple whose values may be combined in any order.
// `lanes`: of a vector of elements.
// Model: a gather loads and inserts each lane; a vector takes one load for each register. There are two loads and two
// operations a cycle, and each register of partial results takes an operation every four cycles. Unknown extents count
// as long.
std::optional<RowReduction> row_reduction(const FuncContents& f, const Definition& update,
                                          int lanes, const planning::Machine& machine,
                                          const SizeEstimate& sizes);

// Vectorizes the loop along rows, and moves the loops of the reduction inside of those over elements. Blocks become a
// Func (rfactor.h) that is computed in the loops of f.
void reduce_along_rows(const FuncPtr& f, int index, const RowReduction& row);

}  // namespace retrograde::autoschedule
