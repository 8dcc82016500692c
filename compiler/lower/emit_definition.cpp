#include "lower/emit_definition.h"

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/cse.h"
#include "simplify/simplify.h"

namespace retrograde::ir {
namespace {

bool is_undef(const Expr& e) {
  const Call* call = e.as<Call>();
  return call && call->is_op(Op::undef);
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
  Stmt stmt = make_provide(f.name(), {shared.values.begin(), args_begin}, {args_begin, shared.values.end()});
  for (auto it = shared.lets.rbegin(); it != shared.lets.rend(); ++it) stmt = make_let(it->first, it->second, stmt);

  if (definition.predicate.defined())
    stmt = make_if(introduce_lets(substitute(definition.predicate, nest.coordinate)), stmt);
  Expr inside = conjunction(nest.guards);
  return is_const_true(inside) ? stmt : make_if(inside, stmt);
}

Requirements requirements_of(const LoopedFunc& f, int stage, const StageNest& nest, const ValueBounds& values) {
  const Definition& definition = f.stages[stage];
  Scope<Interval> point;
  for (const auto& [var, value] : nest.guarded_coordinate) point.push(var, Interval::point(value));
  Requirements uses;
  auto add = [&](const Expr& e) { merge_footprints(uses, footprints(e, point, &values)); };
  for (const Expr& value : definition.values) {
    // Where the predicate is false nothing is read.
    bool guarded = definition.predicate.defined() && !value.type().is_handle() && !is_undef(value);
    add(guarded ? call_op(Op::if_then_else, value.type(), {definition.predicate, value, make_zero(value.type())}) : value);
  }
  Footprint written;
  for (const Expr& arg : definition.args) {
    add(arg);
    written.box.push_back(bounds_of(arg, point, &values));
  }
  if (definition.predicate.defined()) add(definition.predicate);
  written.symbol = SymbolRef(f.func);
  merge_footprints(uses, {{f.name(), written}});
  return uses;
}

}  // namespace retrograde::ir
