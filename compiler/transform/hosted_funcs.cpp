#include "transform/hosted_funcs.h"

#include <algorithm>
#include <iterator>

#include "graph/directives/wrappers.h"

namespace retrograde::transform {

namespace {

bool is_in(const graph::LoopLevel& level, const FuncContents& host) {
  return level.kind == graph::LoopLevel::Kind::At && level.func == host.name;
}

}  // namespace

HostedFuncs::HostedFuncs(const std::vector<FuncPtr>& outputs) {
  for (const FuncPtr& f : graph::functions_of(outputs)) {
    bool is_hosted = false;
    for (const graph::LoopLevel& level : {f->schedule.compute_level, f->schedule.store_level}) {
      if (level.kind != graph::LoopLevel::Kind::At) continue;
      loops_.insert({level.func, level.var});
      is_hosted = true;
    }
    if (is_hosted) funcs_.push_back(f);
  }
}

bool HostedFuncs::are_in(const FuncContents& host, const std::string& loop) const {
  return loops_.contains({host.name, loop});
}

bool HostedFuncs::are_in(const FuncContents& host) const {
  const auto first = loops_.lower_bound({host.name, ""});
  return first != loops_.end() && first->first == host.name;
}

std::vector<FuncPtr> HostedFuncs::computed_in(const FuncContents& host) const {
  std::vector<FuncPtr> result;
  std::ranges::copy_if(funcs_, std::back_inserter(result),
                       [&](const FuncPtr& f) { return is_in(f->schedule.compute_level, host); });
  return result;
}

bool HostedFuncs::are_computed_where_stored(const FuncContents& host) const {
  return std::ranges::all_of(funcs_, [&](const FuncPtr& f) {
    return is_in(f->schedule.compute_level, host) || !is_in(f->schedule.store_level, host);
  });
}

}  // namespace retrograde::transform
