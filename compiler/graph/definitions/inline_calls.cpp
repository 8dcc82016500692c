// inline_calls -- f(x) = g(x + 1), g(x) = x * x  =>  f(x) = (x + 1) * (x + 1).
#include "graph/definitions/inline_calls.h"

#include <algorithm>

#include "diagnostics/error.h"

namespace retrograde::graph {

namespace {

void check(const FuncContents& f, const FuncContents& inlined) {
  const std::string asked =
      text("inline ", quoted(inlined.name), " into a definition of ", quoted(f.name));
  if (!inlined.is_defined() || !inlined.is_pure()) {
    user_error(asked, "an inlined Func has one pure definition",
               !inlined.is_defined() ? "it has none"
               : inlined.is_extern() ? "a C function computes it"
                                     : "it has update definitions",
               "Leave it out");
  }
  if (inlined.schedule.compute_level.kind != LoopLevel::Kind::Inlined ||
      !inlined.pure->schedule.specializations.empty() || inlined.schedule.memoized ||
      inlined.schedule.async) {
    user_error(asked, "an inlined Func has no schedule of its own",
               "it is computed somewhere, or specialized", "Leave its schedule out");
  }
}

Expr inline_calls(const Expr& e, const FuncContents& inlined) {
  return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
    const Call* call = node.as<Call>();
    if (!call || call->call_type != CallType::Func || call->symbol.raw() != &inlined) return {};
    Substitution at_point;
    for (size_t i = 0; i < inlined.args.size(); i++)
      at_point[inlined.args[i]] = recurse(call->args[i]);
    return substitute(inlined.pure->values[static_cast<size_t>(call->component)], at_point);
  });
}

}  // namespace

void inline_into(const SchedulePlace& place, const std::vector<FuncPtr>& inlined) {
  FuncContents& f = *place.f;
  for (const FuncPtr& g : inlined) check(f, *g);
  // Consumers first, because inlining them adds calls of their producers.
  std::vector<FuncPtr> order = topological_order(inlined);
  std::erase_if(order,
                [&](const FuncPtr& g) { return std::ranges::find(inlined, g) == inlined.end(); });
  std::ranges::reverse(order);
  Definition& stage = f.stage(place.stage);
  for (const FuncPtr& g : order) {
    const auto inlined_here = [&](Expr& e) {
      if (e.defined()) e = inline_calls(e, *g);
    };
    std::ranges::for_each(stage.values, inlined_here);
    if (place.stage > 0) std::ranges::for_each(stage.args, inlined_here);
    inlined_here(stage.predicate);
  }
  f.version++;
}

}  // namespace retrograde::graph
