#include "autoschedule/cost/motion.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/lets.h"
#include "ir/scalar.h"

namespace retrograde::planning {

namespace {

Motion resting(size_t iterators) {
  return {false, std::vector<std::optional<double>>(iterators, 0)};
}

bool rests(const Motion& motion) {
  return !motion.is_table && motion == resting(motion.slopes.size());
}

void add_motion(Motion& sum, const Motion& other, double factor) {
  sum.is_table = sum.is_table || other.is_table;
  for (size_t i = 0; i < sum.slopes.size(); ++i) {
    std::optional<double>& slope = sum.slopes[i];
    if (slope && other.slopes[i])
      *slope += factor * *other.slopes[i];
    else
      slope.reset();
  }
}

Motion scaled_motion(const Motion& motion, std::optional<double> factor) {
  Motion result = resting(motion.slopes.size());
  add_motion(result, motion, factor.value_or(1));
  for (std::optional<double>& slope : result.slopes) {
    if (!factor && slope != 0.0) slope.reset();
  }
  return result;
}

std::optional<double> constant_of(const Expr& e) {
  const auto scalar = as_scalar(e);
  return scalar ? std::optional(scalar->as_double()) : std::nullopt;
}

}  // namespace

Motions::Motions(const AccessGraph& graph) : graph_(graph) {
  for (const FuncNode& node : graph.funcs()) {
    for (const StageNode& stage : node.stages) {
      Names iterators;
      for (const Iterator& i : stage.iterators) iterators.emplace(i.name, iterators.size());
      Known known;
      const auto note = [&](const Access& access) {
        for (const IndexForm& form : access.index) {
          for (const OpaqueTerm& term : form.opaque) {
            if (!term.expr.defined() || by_number_.contains(term.value.number)) continue;
            const Motion all = of(without_lets(term.expr), iterators, known);
            Motion own{all.is_table, {}};
            for (const int16_t i : term.value.iterators)
              own.slopes.push_back(all.slopes[static_cast<size_t>(i)]);
            by_number_.emplace(term.value.number, std::move(own));
          }
        }
      };
      note(stage.write);
      for (const Access& read : stage.reads) note(read);
    }
  }
}

Motion Motions::of(const Expr& e, const Names& iterators, Known& known) {
  if (const Motion* found = ir::find_or_null(known, e.get())) return *found;
  Motion motion = find(e, iterators, known);
  return known.emplace(e.get(), std::move(motion)).first->second;
}

Motion Motions::find(const Expr& e, const Names& iterators, Known& known) {
  Motion result = resting(iterators.size());
  const auto part = [&](const Expr& operand) { return of(operand, iterators, known); };
  if (const auto* v = e.as<Variable>()) {
    if (const size_t* i = ir::find_or_null(iterators, v->name)) result.slopes[*i] = 1;
    return result;
  }
  if (const auto* call = e.as<Call>()) return of_call(*call, iterators, known);
  if (const auto* cast = e.as<Cast>()) return part(cast->value);
  if (const auto* select = e.as<Select>()) return part(select->when_true);
  const auto* binary = e.as<Binary>();
  if (!binary) return result;
  const Motion a = part(binary->a), b = part(binary->b);
  switch (e.kind()) {
    case Kind::Add:
    case Kind::Sub:
      add_motion(result, a, 1);
      add_motion(result, b, e.kind() == Kind::Add ? 1 : -1);
      return result;
    case Kind::Mul:
      if (rests(b)) return scaled_motion(a, constant_of(binary->b));
      return scaled_motion(b, rests(a) ? constant_of(binary->a) : std::nullopt);
    case Kind::Div: {
      const auto divisor = constant_of(binary->b);
      return scaled_motion(a, divisor ? std::optional(1 / *divisor) : std::nullopt);
    }
    default:
      return rests(a) ? b : a;  // of a minimum or a maximum
  }
}

Motion Motions::of_call(const Call& call, const Names& iterators, Known& known) {
  Motion result = resting(iterators.size());
  if (call.call_type == CallType::Operator)
    return call.args.empty() ? result : of(call.args[0], iterators, known);
  const bool is_func = call.call_type == CallType::Func;
  if (!is_func || graph_.func(graph_.find(call.symbol.raw())).stages.size() != 1) {
    result.is_table = !call.type.is_float();
    return result;
  }
  const Motion& own = of_func(graph_.find(call.symbol.raw()), static_cast<size_t>(call.component));
  result.is_table = own.is_table;
  for (size_t d = 0; d < call.args.size(); ++d)
    add_motion(result, scaled_motion(of(call.args[d], iterators, known), own.slopes[d]), 1);
  return result;
}

const Motion& Motions::of_func(FuncId func, size_t component) {
  const uint64_t key = static_cast<uint64_t>(func) << 32 | component;
  if (const Motion* found = ir::find_or_null(funcs_, key)) return *found;
  const FuncContents& f = *graph_.func(func).func;
  Motion motion = resting(f.args.size());
  if (!f.is_extern()) {
    Names iterators;
    for (const std::string& arg : f.args) iterators.emplace(arg, iterators.size());
    Known known;
    motion = of(without_lets(f.stage(0).values[component]), iterators, known);
  }
  return funcs_.emplace(key, std::move(motion)).first->second;
}

}  // namespace retrograde::planning
