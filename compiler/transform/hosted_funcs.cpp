#include "transform/hosted_funcs.h"

#include "graph/directives/wrappers.h"

namespace retrograde::transform {

std::set<std::string> hosts_in(const std::vector<FuncPtr>& outputs) {
  std::set<std::string> result;
  for (const FuncPtr& f : graph::functions_of(outputs)) {
    for (const graph::LoopLevel& level : {f->schedule.compute_level, f->schedule.store_level})
      if (level.kind == graph::LoopLevel::Kind::At) result.insert(level.func);
  }
  return result;
}

}  // namespace retrograde::transform
