#include "transform/large_bodies.h"

#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "graph/definitions/inlined_size.h"
#include "graph/directives/give_directive.h"
#include "transform/placement_limits.h"

namespace retrograde::transform {

namespace {

// Nodes of an expression, with what is inlined into it. Hand-written bodies have a few hundred at
// most, and a code generator takes some seconds for ten thousand.
constexpr double most_nodes = 2000;

}  // namespace

std::vector<FuncPtr> large_bodies(const std::vector<FuncPtr>& outputs,
                                  const std::vector<FuncPtr>& stored) {
  const std::vector<FuncPtr> order = topological_order(outputs);
  std::unordered_set<const Symbol*> has_place;
  for (const FuncPtr& f : outputs) has_place.insert(f.get());
  for (const FuncPtr& f : stored) has_place.insert(f.get());
  std::unordered_map<const Symbol*, int> reads;
  for (const FuncPtr& f : order) {
    for (const auto& [callee, calls] : func_calls(*f)) reads[callee] += calls;
  }
  std::optional<PlacementLimits> limits;  // large bodies are rare, and these take an analysis
  const auto can_move = [&](const FuncPtr& f) {
    if (has_directives(*f)) return false;
    if (!limits) limits = placement_limits(order);
    return !limits->stay.contains(f.get());
  };
  InlinedSizes sizes;
  std::vector<FuncPtr> result;
  for (const FuncPtr& f : order) {
    const bool is_inlined = f->is_pure() && !has_place.contains(f.get()) &&
                            f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    if (!is_inlined) continue;
    const double nodes = sizes.nodes(*f);
    if (nodes > most_nodes && reads[f.get()] > 1 && can_move(f))
      result.push_back(f);
    else
      sizes.inline_calls_of(*f, nodes);
  }
  return result;
}

}  // namespace retrograde::transform
