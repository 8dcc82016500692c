#include "autoschedule/cost/motion.h"

#include <algorithm>
#include <cmath>

#include "ir/build.h"
#include "ir/lets.h"
#include "ir/scalar.h"

namespace retrograde::planning {

namespace {

bool rests(const Motion& motion) {
  return !motion.is_table && std::ranges::all_of(motion.slopes, [](double s) { return s == 0; });
}

// Unknown factors leave what rests at rest.
Motion sum(Motion a, const Motion& b, double factor = 1) {
  a.is_table = a.is_table || b.is_table;
  for (size_t i = 0; i < a.slopes.size(); ++i)
    a.slopes[i] += b.slopes[i] == 0 ? 0 : factor * b.slopes[i];
  return a;
}

double constant_or_unknown(const Expr& e) {
  const auto scalar = as_scalar(e);
  return scalar ? scalar->as_double() : NAN;
}

}  // namespace

Motions::Motions(const AccessGraph& graph) : graph_(graph) {
  for (const FuncNode& node : graph.funcs()) {
    for (const StageNode& stage : node.stages) {
      Scope scope;
      for (const Iterator& i : stage.iterators)
        scope.iterators.emplace(i.name, scope.iterators.size());
      note(stage.write, scope);
      for (const Access& read : stage.reads) note(read, scope);
    }
  }
}

void Motions::note(const Access& access, Scope& scope) {
  for (const IndexForm& form : access.index) {
    for (const auto& [value, coefficient, range, expr] : form.opaque) {
      if (!expr.defined() || by_number_.contains(value.number)) continue;
      const Expr index = without_lets(expr);
      const Motion all = of(index, scope);
      Motion& motion = by_number_[value.number];
      motion.is_table = all.is_table;
      motion.slopes = ir::mapped(value.iterators,
                                 [&](int16_t i) { return all.slopes[static_cast<size_t>(i)]; });
      if (index.kind() == Kind::Mod)
        motion.period = std::max(0.0, constant_or_unknown(index.as<Binary>()->b));
    }
  }
}

Motion Motions::of(const Expr& e, Scope& scope) {
  if (const Motion* found = ir::find_or_null(scope.known, e.get())) return *found;
  Motion motion = find(e, scope);
  return scope.known.emplace(e.get(), std::move(motion)).first->second;
}

Motion Motions::find(const Expr& e, Scope& scope) {
  Motion rest{false, std::vector<double>(scope.iterators.size())};
  if (const auto* v = e.as<Variable>()) {
    if (const size_t* i = ir::find_or_null(scope.iterators, v->name)) rest.slopes[*i] = 1;
    return rest;
  }
  if (const auto* call = e.as<Call>()) return of_call(*call, scope);
  if (const auto* cast = e.as<Cast>()) return of(cast->value, scope);
  if (const auto* select = e.as<Select>()) return of(select->when_true, scope);
  const auto* binary = e.as<Binary>();
  if (!binary) return rest;
  const Motion a = of(binary->a, scope), b = of(binary->b, scope);
  if (e.kind() == Kind::Add) return sum(a, b);
  if (e.kind() == Kind::Sub) return sum(a, b, -1);
  if (e.kind() == Kind::Div) return sum(rest, a, 1 / constant_or_unknown(binary->b));
  if (e.kind() == Kind::Mul)
    return rests(b) ? sum(rest, a, constant_or_unknown(binary->b))
                    : sum(rest, b, constant_or_unknown(binary->a));
  return rests(a) ? b : a;  // of a minimum or a maximum
}

Motion Motions::of_call(const Call& call, Scope& scope) {
  Motion result{false, std::vector<double>(scope.iterators.size())};
  if (call.call_type == CallType::Operator)
    return call.args.empty() ? result : of(call.args[0], scope);
  const FuncId func = call.call_type == CallType::Func ? graph_.find(call.name) : -1;
  if (func < 0 || graph_.func(func).stages.size() != 1 || graph_.func(func).func->is_extern()) {
    result.is_table = !call.type.is_float();
    return result;
  }
  const Motion& own = of_func(func, static_cast<size_t>(call.component));
  result.is_table = own.is_table;
  for (size_t d = 0; d < call.args.size(); ++d)
    if (own.slopes[d] != 0) result = sum(result, of(call.args[d], scope), own.slopes[d]);
  return result;
}

const Motion& Motions::of_func(FuncId func, size_t component) {
  const uint64_t key = static_cast<uint64_t>(func) << 32 | component;
  if (const Motion* found = ir::find_or_null(funcs_, key)) return *found;
  const FuncContents& f = *graph_.func(func).func;
  Scope scope;
  for (const std::string& arg : f.args) scope.iterators.emplace(arg, scope.iterators.size());
  Motion motion = of(without_lets(f.stage(0).values[component]), scope);
  return funcs_.emplace(key, std::move(motion)).first->second;
}

}  // namespace retrograde::planning
