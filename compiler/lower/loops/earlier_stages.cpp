#include "lower/loops/earlier_stages.h"

#include <algorithm>
#include <set>

#include "analysis/linear.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

bool reads_storage(const Expr& e) {
  return any_node(e, [](const Call& call) { return call.call_type != CallType::Operator; });
}

bool stores_only_to(const std::string& func, const Stmt& nest) {
  std::set<std::string> own = {func};
  walk(nest, [&](const Realize& n) { own.insert(n.name); });
  return !any_node(
      nest,
      [](const Expr& e) {
        const auto* call = e.as<Call>();
        return call && (!call->is_pure() || (call->is_extern() && !call->is_pure_extern()));
      },
      [&](const Stmt& s) {
        switch (s.kind()) {
          case Kind::Provide:
            return own.count(s.as<Provide>()->name) == 0;
          case Kind::For: {
            const ForType runs = s.as<For>()->runs;
            return runs != ForType::Serial && runs != ForType::Parallel &&
                   runs != ForType::Vectorized && runs != ForType::Unrolled;
          }
          case Kind::Evaluate:
            return !is_const(s.as<Evaluate>()->value);
          case Kind::LetStmt:
          case Kind::IfThenElse:
          case Kind::Block:
          case Kind::Realize:
          case Kind::ProducerConsumer:
            return false;
          default:
            return true;
        }
      });
}

bool EarlierStages::add(const Stmt& nest) {
  if (const auto* empty = nest.as<Evaluate>()) return is_const(empty->value);
  if (!stores_only_to(func_, nest)) return false;
  const Provide* store = nullptr;
  int stores = 0;
  walk(nest, [&](const Provide& n) {
    if (n.name == func_ && ++stores == 1) store = &n;
  });
  if (stores != 1) return false;
  EarlierStage stage{nest};
  const Expr time = simplify(value_(store->args[steps_.dimension]));
  if (!find_time_loop(time, stage) || !reads_only_at(time, nest)) return false;
  steps_.earlier.push_back(std::move(stage));
  return true;
}

bool EarlierStages::find_time_loop(const Expr& time, EarlierStage& stage) {
  const For* found = nullptr;
  int loops = 0;
  walk(stage.nest, [&](const For& loop) {
    if (!uses_variable(time, loop.name)) return;
    ++loops;
    found = &loop;
  });
  stage.offset = time;
  if (loops == 0) return !reads_storage(time);
  if (loops > 1 || (found->runs != ForType::Serial && found->runs != ForType::Parallel))
    return false;
  const auto form = analysis::decompose(time, {found->name});
  if (!form || form->coefficients.size() != 1 || std::abs(form->coefficients[0].second) != 1 ||
      reads_storage(form->rest))
    return false;
  stage.over_time = found;
  stage.sign = static_cast<int>(form->coefficients[0].second);
  stage.offset = form->rest;
  return true;
}

bool EarlierStages::reads_only_at(const Expr& time, const Stmt& nest) const {
  bool same = true;
  walk(nest, [&](const Call& call) {
    if (call.call_type == CallType::Func && call.name == func_)
      same = same && is_zero(simplify(value_(call.args[steps_.dimension]) - time));
  });
  return same;
}

// The expressions of a nest that decide which elements it stores; `with_values`: and what it stores.
std::vector<Expr> EarlierStages::parts_of(const Stmt& nest, const For* except,
                                          bool with_values) const {
  std::vector<Expr> parts;
  const auto add = [&](const Expr& e) {
    if (e.defined()) parts.push_back(value_(e));
  };
  walk(
      nest,
      [&](const For& loop) {
        if (&loop == except) return;
        add(loop.min);
        add(loop.extent);
      },
      [&](const IfThenElse& n) { add(n.condition); },
      [&](const Provide& n) {
        for (size_t d = 0; d < n.args.size(); ++d) {
          if (n.name != func_ || d != steps_.dimension) add(n.args[d]);
        }
        add(n.predicate);
        for (size_t i = 0; with_values && i < n.values.size(); ++i) add(n.values[i]);
      });
  return parts;
}

// Whether every step stores the same elements of its slice.
bool EarlierStages::steps_store_alike(const Stmt& step) const {
  return std::ranges::none_of(parts_of(step, step.as<For>(), false), [&](const Expr& e) {
    return uses_variable(e, steps_.loop->name) || reads_storage(e);
  });
}

static bool are_alike(const std::vector<Expr>& parts, const std::string& time,
                      const BoundsMap& range) {
  return std::ranges::none_of(
      parts, [&](const Expr& e) { return uses_variable(simplify(e, range), time); });
}

SliceStart EarlierStages::slice_start(const Stmt& step, const Interval& iterations) const {
  if (steps_.earlier.size() != 1 || !steps_store_alike(step)) return SliceStart::EveryStep;
  const EarlierStage& stage = steps_.earlier[0];
  if (!stage.over_time) return SliceStart::EveryStep;
  const std::string& time = stage.over_time->name;
  const std::vector<Expr> parts = parts_of(stage.nest, stage.over_time, true);
  if (are_alike(parts, time, {})) return SliceStart::Never;
  Expr first = (time_at(steps_, iterations.min) - stage.offset) * stage.sign;
  Expr last = (time_at(steps_, iterations.max) - stage.offset) * stage.sign;
  if (steps_.sign * stage.sign < 0) std::swap(first, last);
  const bool is_alike = are_alike(parts, time, {{time, {simplify(first), simplify(last)}}});
  return is_alike ? SliceStart::FirstSteps : SliceStart::EveryStep;
}

}  // namespace retrograde::lower
