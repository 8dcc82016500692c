#include "autodiff/updates/update_context.h"

#include <algorithm>
#include <set>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

bool depends_on_data(const Expr& e) {
  return any_node(e, [&](const Call& call) { return call.call_type != CallType::Operator; });
}

std::string point_text(const std::string& name, const std::vector<Expr>& args) {
  return quoted(name) + "(" + listed(args, [](const Expr& arg) { return ir::print(arg); }) + ")";
}

size_t place_number(std::vector<std::vector<Expr>>& places, const std::vector<Expr>& place) {
  const auto known =
      std::ranges::find_if(places, [&](const auto& p) { return same_args(p, place); });
  const size_t number = static_cast<size_t>(known - places.begin());
  if (known == places.end()) places.push_back(place);
  return number;
}

IterationDomain restricted(IterationDomain domain, const Expr& condition) {
  if (is_const_true(condition)) return domain;
  domain.predicate = domain.predicate.defined() ? domain.predicate && condition : condition;
  return domain;
}

namespace {

bool mentions_undef(const Expr& e) {
  return any_node(e, [](const Call& call) { return call.is_op(Op::undef); });
}

// A value, and the condition under which it contains no undef.
struct PartlyDefined {
  Expr where, value;
};

PartlyDefined defined_part(const Expr& e);

PartlyDefined chosen_part(const Expr& condition, const Expr& if_true, const Expr& if_false) {
  PartlyDefined a = defined_part(if_true), b = defined_part(if_false);
  if (mentions_undef(condition)) return {const_false(), a.value};
  if (is_const_false(a.where)) return {logical_not(condition) && b.where, b.value};
  if (is_const_false(b.where)) return {condition && a.where, a.value};
  return {make_select(condition, a.where, b.where), make_select(condition, a.value, b.value)};
}

PartlyDefined defined_part(const Expr& e) {
  if (!mentions_undef(e)) return {const_true(), e};
  if (const auto* s = e.as<Select>()) return chosen_part(s->condition, s->when_true, s->when_false);
  if (const Call* call = as_op(e, Op::if_then_else))
    return chosen_part(call->args[0], call->args[1], call->args[2]);
  if (as_op(e, Op::undef)) return {const_false(), e};
  Expr where = const_true();
  Expr value = map_children(e, [&](const Expr& child) {
    PartlyDefined part = defined_part(child);
    where = where && part.where;
    return part.value;
  });
  return {where, value};
}

// Makes it explicit that the old value stays where an update's value is undef.
Expr with_old_value(const Expr& value, const Expr& old) {
  PartlyDefined part = defined_part(value);
  if (is_const_true(part.where)) return value;
  return is_const_false(part.where) ? old : make_select(simplify(part.where), part.value, old);
}

}  // namespace

UpdateContext::UpdateContext(const UpdateQuery& query)
    : query(query),
      f(query.f.get()),
      definition(query.f->stage(query.stage)),
      domain(query.regions.domain(*query.f, query.stage)) {
  for (const Expr& a : definition.args) write.push_back(without_lets(a));
  for (size_t k = 0; k < definition.values.size(); ++k) {
    Expr old = call_value(query.f, write, static_cast<int>(k));
    values.push_back(with_old_value(without_lets(definition.values[k]), old));
  }
  for (size_t d = 0; d < f->args.size(); ++d) {
    pure.push_back(is_pure_position(*f, definition, d));
    point.push_back(variable(f->args[d]));
  }
}

std::string UpdateContext::asked() const {
  std::string right = listed(definition.values, [](const Expr& v) { return ir::print(v); });
  if (right.size() > 200) right = right.substr(0, 200) + "...";
  return "differentiate the update " + point_text(f->name, write) + " = " + right;
}

namespace {
void collect_self_reads(const Expr& e, const FuncContents* f, std::set<Expr, StructuralLess>& seen,
                        std::vector<Expr>& reads) {
  walk(e, [&](const Expr& node) {
    const Call* call = as_call_of(node, f);
    if (!call) return true;
    if (seen.contains(node)) return false;
    for (const Expr& arg : call->args) collect_self_reads(arg, f, seen, reads);
    seen.insert(node);
    reads.push_back(node);
    return false;
  });
}
}  // namespace

std::vector<Expr> UpdateContext::self_reads() const {
  std::set<Expr, StructuralLess> seen;
  std::vector<Expr> reads;
  for (const Expr& v : values) collect_self_reads(v, f, seen, reads);
  for (const Expr& w : write) collect_self_reads(w, f, seen, reads);
  return reads;
}

std::vector<Expr> UpdateContext::needed_reads(const SweepResult& sweep) const {
  std::set<Expr, StructuralLess> found;
  const auto need = [&](const Expr& e) {
    walk(e, [&](const Expr& node) {
      if (as_call_of(node, f)) found.insert(node);
      return true;
    });
  };
  for (const LeafAdjoint& leaf : sweep.leaves) {
    need(leaf.adjoint);
    for_each_child(leaf.leaf, need);
  }
  for (const Expr& w : write) need(w);
  std::vector<Expr> reads = self_reads();
  std::erase_if(reads, [&](const Expr& read) { return !found.contains(read); });
  return reads;
}

SweepResult UpdateContext::sweep(const std::vector<Expr>& seeds) const {
  return sweep_reverse(
      values, seeds, [&](const Expr& leaf) { return as_call_of(leaf, f) || query.is_wanted(leaf); },
      query.ranges);
}

std::vector<Expr> UpdateContext::adjoints_at(const FuncPtr& adjoint,
                                             const std::vector<Expr>& place) const {
  return numbered(values.size(), [&](size_t k) {
    return f->types[k].is_float() ? call_value(adjoint, place, static_cast<int>(k)) : Expr();
  });
}

std::vector<Expr> UpdateContext::adjoints_at_write(const FuncPtr& adjoint) const {
  return adjoints_at(adjoint, write);
}

SweepResult UpdateContext::sweep_at_write(const FuncPtr& adjoint) const {
  return sweep(adjoints_at_write(adjoint));
}

SweepResult UpdateContext::sweep_iterations(const FuncPtr& adjoint,
                                            FunctionRef<std::vector<Expr>()> seeds) const {
  AdjointTraits& traits = adjoint->made->traits;
  AdjointTraits before;
  SweepResult result;
  do {
    before = traits;
    result = sweep(seeds());
    for (const LeafAdjoint& leaf : result.leaves) {
      if (as_call_of(leaf.leaf, f)) traits.add(traits_of(leaf.adjoint));
    }
  } while (traits != before);
  return result;
}

void UpdateContext::check_versions_are_kept(const Expr& read) const {
  if (query.versions.keeps_any()) return;
  const auto* call = read.as<Call>();
  user_error(
      asked(),
      "a partial derivative may need only values that are still there when the Func is complete",
      text("it needs ", point_text(f->name, call->args),
           " as it was before an update overwrote it"),
      text("Give ", quoted(f->name),
           " one more dimension that keeps the versions, or pass "
           "AdjointOptions{.overwritten = Overwritten::Store} to let the compiler keep them"));
}

void UpdateContext::take_room(const FuncPtr& copy, const std::vector<Expr>& extents,
                              UpdateAdjoint& result) const {
  FuncPtr check = query.versions.take({copy, extents, f->name, asked()}, result.explanations);
  if (check) result.helpers.push_back(check);
}

std::vector<Expr> UpdateContext::extents() const {
  return mapped(query.regions.of(f), [](const Interval& side) {
    return side.is_bounded() ? side.max - side.min + 1 : Expr();
  });
}

AdjointFunc UpdateContext::adjoint_before(const std::vector<Expr>& initial,
                                          const std::vector<Contribution>& contributions) const {
  return make_adjoint(query.target, text(f->name, "_adj_before_update", query.stage - 1),
                      contributions, initial);
}

void UpdateContext::hand_over(const FuncPtr& steps, const std::vector<Expr>& seeds,
                              const std::vector<Expr>& before, UpdateAdjoint& result) const {
  result.previous = adjoint_before(before);
  result.helpers.push_back(steps);
  result.values = values;
  result.keeps_steps = true;
  result.seeds = seeds;
  result.domains = {domain};
}

void UpdateContext::note(const std::string& what, UpdateAdjoint& result,
                         Explanation::Kind kind) const {
  result.explanations.push_back({kind, f->name, text("update ", query.stage - 1, what)});
}

Expr replaced(const Expr& e, const SelfValues& values) {
  if (values.empty()) return e;
  return rewrite(e, [&](const Expr& node, const auto& recurse) {
    auto it = values.find(node);
    return it != values.end() ? it->second : map_children(node, recurse);
  });
}

Expr with_values(const Expr& e, const FuncPtr& f, const SelfValues& self_values) {
  if (!e.defined() || f->updates.empty()) return e;
  return redirect_calls(replaced(e, self_values), f, f, false);
}

}  // namespace retrograde::autodiff
