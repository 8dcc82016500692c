#include "autoschedule/plan/loop_names.h"

#include <algorithm>
#include <set>

#include "autoschedule/plan/nest.h"
#include "diagnostics/error.h"
#include "graph/directives/give_directive.h"
#include "graph/names.h"

namespace retrograde::planning {

std::string LoopNames::of(const Nest& nest, const Part& part) const {
  if (part.iterator == once) return graph::outermost_loop;
  const std::vector<Part> all = parts_of(nest, part.iterator);
  const auto at = std::ranges::find(all, part.step, &Part::step) - all.begin();
  return parts[static_cast<size_t>(part.iterator)][static_cast<size_t>(at)];
}

LoopNames loop_names(const graph::FuncContents& f, int stage, const Nest& nest) {
  std::vector<std::string> iterators = iterators_of(f, stage);
  for (const graph::Split& name : graph::factored_names(f, stage))
    std::ranges::replace(iterators, name.old_var, name.outer);
  LoopNames names;
  std::set<std::string> used(iterators.begin(), iterators.end());
  for (size_t i = 0; i < iterators.size() + nest.fusions.size(); ++i) {
    const std::string base = i < iterators.size()
                                 ? iterators[i]
                                 : names.of(nest, nest.fusions[i - iterators.size()].inner);
    names.parts.push_back({base});
    for (size_t k = 1; k < parts_of(nest, static_cast<int>(i)).size(); ++k) {
      std::string name = text(graph::without_numbers(base), "_", k);
      while (!used.insert(name).second) name += "_";
      names.parts.back().push_back(name);
    }
  }
  for (const Loop& loop : nest.loops) names.loops.push_back(names.of(nest, loop));
  return names;
}

}  // namespace retrograde::planning
