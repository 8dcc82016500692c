#include "autoschedule/sum_rewrites.h"

#include "autoschedule/invariant_factors.h"
#include "autoschedule/strided_terms.h"
#include "graph/copy_graph.h"

namespace retrograde::autoschedule {

std::vector<FuncPtr> with_rewritten_sums(const std::vector<FuncPtr>& outputs, SumOrder order) {
  std::vector<FuncPtr> result = with_invariant_factors(outputs, order);
  if (!has_strided_terms(result)) return result;
  result = graph::copy_graph(result).outputs;
  leave_out_zero_terms(result);
  return result;
}

}  // namespace retrograde::autoschedule
