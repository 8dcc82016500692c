#include "lower/nests/emit_definition.h"

#include <algorithm>
#include <unordered_set>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/resolve_undef.h"
#include "simplify/cse.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

bool is_comparison(const Expr& e) {
  const Kind kind = e.kind();
  return kind == Kind::LT || kind == Kind::LE || kind == Kind::GT || kind == Kind::GE;
}

// A domain's condition that its vectorized loop decides would mask all iterations of the loops
// around it. Marked likely, it masks only those that reach over the domain's end.
Expr likely_in_lanes(const Expr& condition, const StageNest& nest) {
  std::unordered_set<std::string> lanes;
  for (const Loop& loop : nest.loops) {
    if (loop.runs == ForType::Vectorized) lanes.insert(loop.name);
  }
  if (lanes.empty()) return condition;
  std::vector<Expr> conjuncts;
  add_conjuncts(condition, conjuncts);
  for (Expr& e : conjuncts) {
    if (is_comparison(e) && uses_any_variable(e, lanes)) e = likely(e);
  }
  return conjunction(conjuncts);
}

}  // namespace

Stmt emit_definition(const LoopedFunc& f, int stage, const StageNest& nest) {
  const Definition& definition = f.stages[stage];
  std::vector<Expr> exprs;  // values, then args
  bool stores = false;
  for (const Expr& value : definition.values) {
    stores |= !is_undef(value);
    exprs.push_back(substitute(value, nest.coordinate));
  }
  for (const Expr& arg : definition.args) exprs.push_back(substitute(arg, nest.coordinate));
  if (!stores) return make_evaluate(0);

  SharedLets shared = introduce_lets(exprs);
  auto args_begin = shared.values.begin() + definition.values.size();
  Stmt stmt = make_lets(shared.lets, make_provide(f.name(), {shared.values.begin(), args_begin},
                                                  {args_begin, shared.values.end()}));
  if (definition.schedule.atomic) stmt = make_atomic(f.name(), stmt);

  if (definition.predicate.defined())
    stmt = make_if(
        introduce_lets(likely_in_lanes(substitute(definition.predicate, nest.coordinate), nest)),
        stmt);
  Expr inside = conjunction(nest.guards);
  return is_const_true(inside) ? stmt : make_if(inside, stmt);
}

Requirements requirements_of(const LoopedFunc& f, int stage, const StageNest& nest,
                             const ValueBounds& values) {
  const Definition& definition = f.stages[stage];
  Scope<Interval> point;
  for (const auto& [var, value] : nest.guarded_coordinate) point.push(var, Interval::point(value));
  Requirements uses;
  auto add = [&](const Expr& e) { merge_footprints(uses, footprints(e, point, &values)); };
  // Where the predicate is false nothing is read or written.
  auto add_guarded = [&](const Expr& e) {
    bool guarded = definition.predicate.defined() && !e.type().is_handle() && !is_undef(e);
    add(guarded
            ? call_op(Op::if_then_else, e.type(), {definition.predicate, e, make_zero(e.type())})
            : e);
  };
  for (const Expr& value : definition.values) add_guarded(value);
  // What is written is a box like what is read; the type is of no matter.
  add_guarded(call_func(f.name(), Int(32), definition.args, 0, SymbolRef(f.func)));
  if (definition.predicate.defined()) add(definition.predicate);
  return uses;
}

namespace {

bool reads_memory(const Expr& e) {
  return any_node(e, [&](const Call& call) {
    return call.call_type == CallType::Func || call.call_type == CallType::Image;
  });
}

// Whether values that do not count could do harm: as coordinates, or outside of the pipeline.
bool depends_on_every_value(const Definition& definition) {
  return any_node(definition, [](const Call& call) {
    if (call.call_type == CallType::Operator)
      return op_info(call.op).cls == OpClass::Effect && !call.is_op(Op::random);
    return call.call_type == CallType::Extern || std::ranges::any_of(call.args, reads_memory);
  });
}

}  // namespace

std::set<std::string> funcs_read_rounded(const LoopedFunc& f, int stage, const StageNest& nest,
                                         const Requirements& uses) {
  std::set<std::string> names;
  const Definition& definition = f.stages[stage];
  if (!nest.rounds_up || stage > 0 || depends_on_every_value(definition)) return names;
  for (const auto& [name, use] : uses) {
    if (!use.is_image && name != f.name()) names.insert(name);
  }
  return names;
}

Box read_inside(const LoopedFunc& f, int stage, const Domain& domain, const ValueBounds& values,
                const std::string& func) {
  Scope<Interval> points;
  for (const auto& [var, range] : domain)
    points.push(var, {range.min, simplify(range.min + range.extent - 1)});
  Requirements uses;
  for (const Expr& value : f.stages[stage].values)
    merge_footprints(uses, footprints(value, points, &values));
  const auto found = uses.find(func);
  return found == uses.end() ? Box{} : found->second.box;
}

bool never_stores(const LoopedFunc& f, int stage, const Requirements& uses) {
  return f.stages[stage].predicate.defined() && !uses.count(f.name());
}

}  // namespace retrograde::lower
