#include "transform/graph_rewrites.h"

#include <algorithm>

#include "graph/copy_graph.h"
#include "transform/blocked_recurrences.h"
#include "transform/invariant_factors.h"
#include "transform/strided_terms.h"
#include "transform/wavefronts.h"

namespace retrograde::transform {

bool is_differentiated(const std::vector<FuncPtr>& outputs) {
  return std::ranges::any_of(topological_order(outputs),
                             [](const FuncPtr& f) { return f->made.has_value(); });
}

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

}  // namespace retrograde::transform
