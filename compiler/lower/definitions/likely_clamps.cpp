#include "lower/definitions/likely_clamps.h"

#include <functional>
#include <optional>
#include <string>
#include <unordered_set>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

using NameSet = std::unordered_set<std::string>;

NameSet loop_variables(const LoopedFunc& f, const Definition& stage) {
  NameSet names(f.func->args.begin(), f.func->args.end());
  for (const ReductionVariable& r : stage.rvars) names.insert(r.var);
  return names;
}

// Whether the expression is an integer made of loop variables and parameters only, and not marked yet.
bool is_place_of_loops(const Expr& e, const NameSet& loops) {
  if (!e.type().is_int_or_uint() || !uses_any_variable(e, loops)) return false;
  return !any_node(e, [](const Expr& part) {
    return part.kind() == Kind::Call || part.kind() == Kind::Load || part.kind() == Kind::Select;
  });
}

bool is_other_extreme(const Expr& e, Kind outer) {
  return e.kind() == (outer == Kind::Min ? Kind::Max : Kind::Min);
}

// Matches max(min(place, hi), lo), and the reverse order.
struct Clamp {
  Kind outer;
  Expr place, inner_limit, outer_limit;
};

std::optional<Clamp> as_clamp(const Expr& e, const NameSet& loops) {
  if (e.kind() != Kind::Min && e.kind() != Kind::Max) return {};
  const auto fixed_and_moving = [&](const Binary& n) -> std::optional<std::pair<Expr, Expr>> {
    const bool a_moves = uses_any_variable(n.a, loops), b_moves = uses_any_variable(n.b, loops);
    if (a_moves == b_moves) return {};
    return a_moves ? std::pair(n.b, n.a) : std::pair(n.a, n.b);
  };
  const auto outer = fixed_and_moving(*e.as<Binary>());
  if (!outer || !is_other_extreme(outer->second, e.kind())) return {};
  const auto inner = fixed_and_moving(*outer->second.as<Binary>());
  if (!inner || !is_place_of_loops(inner->second, loops)) return {};
  return Clamp{e.kind(), inner->second, inner->first, outer->first};
}

Expr with_likely_place(const Clamp& clamp) {
  const Kind inner = clamp.outer == Kind::Min ? Kind::Max : Kind::Min;
  return binary(clamp.outer, binary(inner, likely(clamp.place), clamp.inner_limit),
                clamp.outer_limit);
}

void mark_stage(const LoopedFunc& f, Definition& stage) {
  const NameSet loops = loop_variables(f, stage);
  StepRewriter index([&](const Expr& e, const auto& recurse) {
    const std::optional<Clamp> clamp = as_clamp(e, loops);
    return clamp ? with_likely_place(*clamp) : map_children(e, recurse);
  });
  StepRewriter reads([&](const Expr& e, const auto& recurse) -> Expr {
    const auto* call = e.as<Call>();
    const bool reads_element =
        call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
    if (!reads_element) return {};
    const bool is_own = call->symbol.raw() == f.func.get();
    return is_own ? e : map_children(map_children(e, recurse), index);
  });
  for (Expr& value : stage.values) value = reads(value);
}

}  // namespace

void mark_likely_clamps(Program& program) {
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) mark_stage(f, stage);
  }
}

}  // namespace retrograde::lower
