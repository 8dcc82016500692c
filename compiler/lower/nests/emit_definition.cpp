#include "lower/nests/emit_definition.h"

#include <algorithm>
#include <functional>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/text.h"
#include "ir/visit.h"
#include "lower/definitions/resolve_undef.h"
#include "simplify/cse.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

bool is_comparison(const Expr& e) {
  const Kind kind = e.kind();
  return kind == Kind::LT || kind == Kind::LE || kind == Kind::GT || kind == Kind::GE;
}

// A condition of the domain that depends on vector lanes would mask all iterations of the loops around. Marked likely,
// it masks only those that reach beyond the domain's end.
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

Expr condition_of(const Expr& predicate, const StageNest& nest) {
  return introduce_lets(likely_in_lanes(substitute(predicate, nest.coordinate), nest));
}

Stmt emit_point(const LoopedFunc& f, const Definition& definition, const StageNest& nest) {
  std::vector<Expr> exprs;  // values, then args
  bool stores = false;
  for (const Expr& value : definition.values) {
    stores |= !is_undef(value);
    exprs.push_back(substitute(value, nest.coordinate));
  }
  for (const Expr& arg : definition.args) exprs.push_back(substitute(arg, nest.coordinate));
  if (!stores) return {};

  SharedLets shared = introduce_lets(exprs);
  auto args_begin = shared.values.begin() + definition.values.size();
  Stmt stmt = make_lets(shared.lets, make_provide(f.name(), {shared.values.begin(), args_begin},
                                                  {args_begin, shared.values.end()}));
  if (definition.schedule.atomic) stmt = make_atomic(f.name(), stmt);
  if (!definition.predicate.defined()) return stmt;
  return make_if(condition_of(definition.predicate, nest), stmt);
}

// ---- several points at once ----

// The update of one point in an iteration of an update of several points.
struct PointUpdate {
  Expr condition;  // of this point only; undefined: always
  std::vector<Expr> values, args;
};

Expr simplified_at(const Expr& e, const Substitution& point) {
  return e.defined() ? simplify(substitute(e, point)) : e;
}

// Whether a value or coordinate must be computed before anything is stored.
bool reads_func(const Expr& e, const std::string& func) {
  return any_node(
      e, [&](const Call& call) { return call.call_type == CallType::Func && call.name == func; });
}

// Binds all reads of the Func to names before the stores of all points:
//
//   f(scatter(a, b)) = f(gather(b, a))   =>   let v0 = f(b)
//                                             let v1 = f(a)
//                                             f(a) = v0
//                                             f(b) = v1
//
// The part of the predicate that all points share guards the whole statement. A point with a condition of its own reads
// nothing where that condition fails.
class PointsEmitter {
 public:
  PointsEmitter(const LoopedFunc& f, int stage, const StageNest& nest)
      : f_(f), definition_(f.stages[stage]), nest_(nest), prefix_(stage_prefix(f.name(), stage)) {}

  Stmt run() {
    split_predicate();
    for (size_t i = 0; i < static_cast<size_t>(number_of_points(definition_)); ++i) add_point(i);
    if (updates_.empty()) return {};
    Stmt stmt = stores();
    if (common_.defined()) stmt = make_if(condition_of(common_, nest_), stmt);
    return definition_.schedule.atomic ? make_atomic(f_.name(), stmt) : stmt;
  }

 private:
  const LoopedFunc& f_;
  const Definition& definition_;
  const StageNest& nest_;
  const std::string prefix_;
  Expr common_, own_;  // parts of the predicate
  std::vector<PointUpdate> updates_;

  void split_predicate() {
    std::vector<Expr> conjuncts, common, own;
    if (definition_.predicate.defined()) add_conjuncts(definition_.predicate, conjuncts);
    for (const Expr& e : conjuncts)
      (uses_variable(e, point_number(definition_)->var) ? own : common).push_back(e);
    if (!common.empty()) common_ = conjunction(common);
    if (!own.empty()) own_ = conjunction(own);
  }

  void add_point(size_t i) {
    const Substitution point{{point_number(definition_)->var, Expr(static_cast<int>(i))}};
    const auto here = [&](const Expr& e) {
      return substitute(simplified_at(e, point), nest_.coordinate);
    };
    PointUpdate update{own_.defined() ? here(own_) : Expr(), mapped(definition_.values, here),
                       mapped(definition_.args, here)};
    if (update.condition.defined()) {
      if (is_const_false(update.condition)) return;
      if (is_const_true(update.condition)) update.condition = {};
    }
    if (std::ranges::all_of(update.values, [](const Expr& e) { return is_undef(e); })) return;
    updates_.push_back(std::move(update));
  }

  Stmt stores() {
    std::vector<Expr> exprs;
    for (const PointUpdate& update : updates_) {
      if (update.condition.defined()) exprs.push_back(update.condition);
      for (const std::vector<Expr>* part : {&update.values, &update.args}) {
        for (const Expr& e : *part) exprs.push_back(guarded(e, update.condition));
      }
    }
    SharedLets shared = introduce_lets(exprs);
    auto next = shared.values.begin();
    std::vector<Stmt> stores;
    for (size_t i = 0; i < updates_.size(); ++i) {
      const PointUpdate& update = updates_[i];
      const auto take = [&](const char* part, size_t k) {
        return named(text(prefix_, part, ".", i, ".", k), *next++, shared.lets);
      };
      const Expr condition = update.condition.defined() ? take("condition", 0) : Expr();
      std::vector<Expr> values, args;
      for (size_t k = 0; k < update.values.size(); ++k) values.push_back(take("value", k));
      for (size_t k = 0; k < update.args.size(); ++k) args.push_back(take("place", k));
      const Stmt store = make_provide(f_.name(), std::move(values), std::move(args));
      stores.push_back(condition.defined() ? make_if(condition, store) : store);
    }
    return make_lets(shared.lets, make_block(std::move(stores)));
  }

  Expr guarded(const Expr& e, const Expr& condition) const {
    if (!condition.defined() || is_undef(e) || !reads_memory(e, MemoryReads::Functions)) return e;
    return call_op(Op::if_then_else, e.type(), {condition, e, make_zero(e.type())});
  }

  Expr named(const std::string& name, const Expr& e, Lets& lets) const {
    if (!reads_func(e, f_.name())) return e;
    lets.emplace_back(name, e);
    return variable(name, e.type());
  }
};

}  // namespace

Stmt emit_definition(const LoopedFunc& f, int stage, const StageNest& nest) {
  const Definition& definition = f.stages[stage];
  const Stmt stmt = point_number(definition) ? PointsEmitter(f, stage, nest).run()
                                             : emit_point(f, definition, nest);
  if (!stmt.defined()) return make_evaluate(0);
  Expr inside = conjunction(nest.guards);
  return is_const_true(inside) ? stmt : make_if(inside, stmt);
}

static Requirements requirements_at(const LoopedFunc& f, int stage, const Scope<Interval>& point,
                                    const ValueBounds& values) {
  const Definition& definition = f.stages[stage];
  Requirements uses;
  const auto add_all = [&](const std::function<Expr(const Expr&)>& here) {
    const Expr predicate = definition.predicate.defined() ? here(definition.predicate) : Expr();
    auto add = [&](const Expr& e) { merge_footprints(uses, footprints(e, point, &values)); };
    // Where the predicate is false, nothing is read or written.
    auto add_guarded = [&](const Expr& e) {
      bool guarded = predicate.defined() && !e.type().is_handle() && !is_undef(e);
      add(guarded ? call_op(Op::if_then_else, e.type(), {predicate, e, make_zero(e.type())}) : e);
    };
    for (const Expr& value : definition.values) add_guarded(here(value));
    // The written box is found like a read one; the type does not matter.
    add_guarded(call_func(f.name(), Int(32), mapped(definition.args, here), 0, SymbolRef(f.func)));
    if (predicate.defined()) add(predicate);
  };
  const ReductionVariable* number = point_number(definition);
  for (int i = 0; i < number_of_points(definition); ++i) {
    add_all([&](const Expr& e) { return number ? simplified_at(e, {{number->var, Expr(i)}}) : e; });
  }
  return uses;
}

namespace {

// Whether a coordinate stays inside a table for arbitrary values, as in lut(clamp(f(x), 0, 255)). All of the table must
// be required anyway; known bounds of f may restrict the required part.
bool is_within_constants(const Expr& coordinate, const ValueBounds& values) {
  const Interval any = bounds_of(coordinate, Scope<Interval>());
  if (!any.is_bounded()) return false;
  const Interval usual = bounds_of(coordinate, Scope<Interval>(), &values);
  const auto is_same_constant = [](const Expr& a, const Expr& b) {
    const Expr constant = simplify(a);
    return is_const(constant) && equal(constant, simplify(b));
  };
  return usual.is_bounded() && is_same_constant(any.min, usual.min) &&
         is_same_constant(any.max, usual.max);
}

bool may_do_harm(const Call& call, const ValueBounds& values) {
  if (call.call_type == CallType::Operator)
    return op_info(call.op).cls == OpClass::Effect && !call.is_op(Op::random);
  return call.call_type == CallType::Extern ||
         std::ranges::any_of(call.args, [&](const Expr& coordinate) {
           return reads_memory(coordinate, MemoryReads::Storage) &&
                  !is_within_constants(coordinate, values);
         });
}

}  // namespace

bool tolerates_any_values(const Definition& definition, const ValueBounds& values) {
  return !definition.predicate.defined() &&
         !any_node(definition, [&](const Call& call) { return may_do_harm(call, values); });
}

static Scope<Interval> points_of(const Domain& domain) {
  Scope<Interval> points;
  for (const auto& [var, range] : domain)
    points.push(var, {range.min, simplify(range.min + range.extent - 1)});
  return points;
}

Requirements requirements_of(const LoopedFunc& f, int stage, const StageNest& nest,
                             const ValueBounds& values) {
  Scope<Interval> point;
  for (const auto& [var, value] : nest.guarded_coordinate) point.push(var, Interval::point(value));
  return requirements_at(f, stage, point, values);
}

std::optional<Box> own_elements(const LoopedFunc& f, int stage, const Domain& domain,
                                const ValueBounds& values) {
  Requirements uses = requirements_at(f, stage, points_of(domain), values);
  const auto own = uses.find(f.name());
  return own == uses.end() ? std::nullopt : std::optional(own->second.box);
}

Requirements read_inside(const LoopedFunc& f, const Domain& domain, const ValueBounds& values) {
  const Scope<Interval> points = points_of(domain);
  Requirements uses;
  for (const Expr& value : f.stages[0].values)
    merge_footprints(uses, footprints(value, points, &values));
  return uses;
}

bool never_stores(const LoopedFunc& f, int stage, const Requirements& uses) {
  return f.stages[stage].predicate.defined() && !uses.count(f.name());
}

}  // namespace retrograde::lower
