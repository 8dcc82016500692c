#include "autoschedule/graph_rewrites.h"

#include "autoschedule/blocked_recurrences.h"
#include "autoschedule/invariant_factors.h"
#include "autoschedule/strided_terms.h"
#include "autoschedule/wavefronts.h"
#include "graph/copy_graph.h"

namespace retrograde::autoschedule {

std::vector<FuncPtr> with_graph_rewrites(const std::vector<FuncPtr>& outputs, bool on_gpu,
                                         SumOrder order) {
  std::vector<FuncPtr> result = with_invariant_factors(outputs, order);
  const bool skews = !on_gpu && has_wavefronts(result);
  const bool has_blocks = !on_gpu && has_blocked_recurrences(result, order);
  if (!has_strided_terms(result) && !skews && !has_blocks) return result;
  result = graph::copy_graph(result).outputs;
  leave_out_zero_terms(result);
  if (has_blocks) run_in_blocks(result, order);
  if (skews) run_in_wavefronts(result);
  return result;
}

}  // namespace retrograde::autoschedule
