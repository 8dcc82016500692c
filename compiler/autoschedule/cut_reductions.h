// cut_reductions.h -- sums over a whole domain, to one element or a few, in lanes and parts.
//
//   loss() += e(r.x, r.y)     =>    parts(lane, row) += e(16 t + lane, row)
//                                   sums(lane, i) += parts(lane, 32 s + i)
//                                   loss() += sums(lane, i)
//
// A reduction to one element, or to a few, has no loop that could be vectorized or run in parallel,
// and one chain of float32 additions loses digits with its length: of 12 million terms it is off by
// 2 %. The cut depends on the program alone, so that results are the same bits for every number of
// threads.
#pragma once

#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/register_tile.h"
#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Factors long associative updates of one element, or of a number that is known to be small
// (rfactor.h), of Funcs of this graph that nobody scheduled. The registers of the `machine` hold sums of several
// elements. `but`: not of these.
void cut_reductions(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                    const planning::Machine& machine,
                    const std::unordered_set<const Symbol*>& but = {});

// The reduction variable of a long sum that is cut into rows, each a task; nullopt: it is no such
// sum, or has a single loop.
std::optional<std::string> rows_of_sum(const FuncPtr& f, int stage, const SizeEstimate& sizes);
// Cuts it. The result: the Func with the sums of each row, in lanes; its last loop is over rows.
FuncPtr sum_rows(const FuncPtr& f, int stage);

}  // namespace retrograde::autoschedule
