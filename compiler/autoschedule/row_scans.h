// row_scans.h -- scans along rows run in several rows at once.
//
//   f(r, y) = a * f(r - 1, y) + b(r, y)
//
//   parallel y:                            parallel y by 4:
//     for r: f(r, y) = ...          =>       for r:
//                                              for yi, unrolled or in a vector: f(r, y) = ...
//
// Each element waits for the one before it, so a single row leaves the processor idle for the latency of an iteration.
// Rows are independent of each other: several of them hide that latency, and functions and divisions are computed in
// vectors. The elements that the next iteration reads stay in registers (lower/loops/carry_elements.h).
//
// The number of rows depends on the program alone, so that results have the same bits for every number of threads.
#pragma once

#include <cstdint>
#include <optional>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Whether an update runs along the rows of its Func, and reads elements of the row that earlier iterations wrote.
bool runs_along_row(const FuncContents& f, const Definition& update);

// Rows of an update that run at once, as a dimension and how many of its elements.
struct RowChains {
  size_t dimension = 0;
  int rows = 1;
  bool in_vectors = false;
};

// How many rows of the update run at once, and how; `extent`: of them (nullopt: not known), `other_tasks`: of the loops
// around them.
RowChains chains_of(const FuncContents& f, const Definition& update, std::optional<int64_t> extent,
                    int64_t other_tasks);
// nullopt: the update does not run along rows of memory, its iterations are independent, or it has one row.
std::optional<RowChains> row_chains(const FuncContents& f, const Definition& update,
                                    const SizeEstimate& sizes);

// Gives such an update its loops within a row; those over rows become tasks later. Returns whether it is one.
bool schedule_row_scan(const FuncPtr& f, int stage, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
