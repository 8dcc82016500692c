#include "autoschedule/rewrites/rewrites.h"

#include "autoschedule/rewrites/copy_operands.h"
#include "autoschedule/rewrites/split_sums.h"
#include "graph/copy_graph.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"

namespace retrograde::planning {

std::vector<graph::FuncPtr> with_rewrites(const std::vector<graph::FuncPtr>& outputs,
                                          const RewriteOptions& options, AccessGraph& accesses) {
  const std::vector<graph::FuncPtr> result = graph::copy_graph(outputs).outputs;
  const auto may_change = [&](const graph::FuncContents& f) {
    return !f.is_extern() && !graph::has_directives(f) && !options.kept.contains(f.name);
  };
  if (options.for_device.device) {
    split_for_device(result, options.for_device, may_change);
    return graph::apply_wrappers(result);
  }
  if (options.splits_sums) split_sums(result, may_change, accesses);
  if (options.copies_operands) copy_operands(result, may_change, accesses);
  return graph::apply_wrappers(result);
}

}  // namespace retrograde::planning
