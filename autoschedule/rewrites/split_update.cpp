#include "autoschedule/rewrites/split_update.h"

#include <algorithm>

#include "graph/definitions/rfactor.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"

namespace retrograde::planning {

using namespace graph;

std::string SplitUpdate::split(const std::string& loop, const std::string& outer,
                               const std::string& inner, int64_t factor,
                               const std::string& result) const {
  const Expr by(static_cast<int32_t>(factor));
  give_directive({f_, stage_}, SplitLoop{loop, outer, inner, by, TailStrategy::GuardWithIf});
  return result;
}

std::string SplitUpdate::split(const std::string& loop, const std::string& inner,
                               int64_t factor) const {
  const std::string name = new_name(inner);
  return split(loop, loop, name, factor, name);
}

std::string SplitUpdate::split_outside(const std::string& loop, const std::string& outer,
                                       int64_t factor) const {
  const std::string name = new_name(outer);
  return split(loop, name, loop, factor, name);
}

std::string SplitUpdate::fuse(const std::string& inner, const std::string& outer) const {
  const std::string name = new_name("terms");
  give_directive({f_, stage_}, FuseLoops{inner, outer, name});
  return name;
}

FuncPtr SplitUpdate::factor(const std::vector<std::pair<std::string, std::string>>& loops) {
  std::vector<std::pair<NamedLoop, std::string>> preserved;
  for (const auto& [loop, name] : loops) {
    std::string own = new_name(name);
    const auto is_own = [&](const auto& other) { return other.second == own; };
    while (std::ranges::any_of(preserved, is_own)) own = new_name(own + "_");
    preserved.emplace_back(loop, own);
  }
  made_.push_back(factor_out({f_, stage_}, preserved));
  return made_.back();
}

void SplitUpdate::finish() const {
  reset_loops(*f_);
  for (const FuncPtr& f : made_) reset_loops(*f);
}

std::string SplitUpdate::new_name(std::string wanted) const {
  const SchedulePlace place{f_, stage_};
  const auto is_taken = [&] {
    return std::ranges::count(f_->args, wanted) > 0 ||
           std::ranges::count(place.schedule().dims, wanted, &Dim::var) > 0;
  };
  while (is_taken()) wanted += "_";
  return wanted;
}

}  // namespace retrograde::planning
