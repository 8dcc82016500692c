#include "lower/device/step_accesses.h"

#include <numeric>
#include <unordered_set>

#include "analysis/interval.h"
#include "ir/build.h"
#include "lower/expand_lets_in_scope.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

using Ranges = analysis::Scope<Interval>;

Interval bounds_of_index(const Expr& index, const Ranges& ranges) {
  if (index.type().is_scalar()) return analysis::bounds_of(index, ranges);
  const auto* ramp = index.as<Ramp>();
  const auto stride = ramp ? as_const_int(ramp->stride) : std::nullopt;
  if (!stride || !ramp->base.type().is_scalar()) return Interval::everything();
  const Interval first = analysis::bounds_of(ramp->base, ranges);
  return analysis::hull(first,
                        analysis::bounds_of(ramp->base + ramp->stride * (ramp->lanes - 1), ranges));
}

// An unbounded interval if the ends load memory, which may change between two steps.
Interval without_loads(const Interval& interval) {
  const auto loads = [](const Expr& end) {
    return !end.defined() || any_node(end, [](const Load&) { return true; });
  };
  return loads(interval.min) || loads(interval.max) ? Interval::everything() : interval;
}

// Finds the accesses of a step in terms of names outside of it.
class AccessFinder {
 public:
  explicit AccessFinder(const Stmt& step) {
    walk(step, [&](const Let& n) { inner_.insert(n.name); });
    walk_in_bounds(
        step,
        [&](const Expr& e, const Ranges& ranges) {
          walk(e, [&](const Load& n) { add(n.name, false, n.index, ranges); });
        },
        [&](const Stmt& part, const Ranges& ranges) {
          if (const auto* n = part.as<Store>()) add(n->name, true, n->index, ranges);
        });
  }
  std::vector<Access> found;

 private:
  void add(const std::string& name, bool stores, const Expr& index, const Ranges& ranges) {
    const Interval elements = known(bounds_of_index(index, ranges));
    for (Access& other : found) {
      if (other.name != name || other.stores != stores) continue;
      other.elements = analysis::hull(other.elements, elements);
      return;
    }
    found.push_back({name, stores, elements});
  }

  // Only ends that are the same for all threads are known.
  Interval known(const Interval& interval) const {
    const auto is_inner = [&](const Expr& end) {
      return !end.defined() || uses_any_variable(end, inner_);
    };
    return is_inner(interval.min) || is_inner(interval.max) ? Interval::everything() : interval;
  }

  std::unordered_set<std::string> inner_;  // names bound inside expressions
};

// Makes `common` a multiple of the divisors of all remainders that involve the loop's variable.
void find_divisors(const Expr& e, const std::string& loop, int64_t& common) {
  walk(e, [&](const Mod& n) {
    const auto divisor = as_const_int(n.b);
    if (divisor && *divisor > 0 && uses_variable(n.a, loop)) common = std::lcm(common, *divisor);
  });
}

}  // namespace

Interval StepSurroundings::range_of(const For& loop) const {
  const Expr min = simplify(expand_lets_in_scope(loop.min, lets_)),
             extent = expand_lets_in_scope(loop.extent, lets_);
  return {min, simplify(min + extent - 1)};
}

void StepSurroundings::enter(const For& loop) {
  const Interval range = range_of(loop);
  facts_.bind(loop.name, range.min, range.max);
  facts_.forget();
  loops_.push_back(&loop);
}

void StepSurroundings::leave(const For& loop) {
  facts_.unbind(loop.name);
  facts_.forget();
  loops_.pop_back();
}

std::vector<Access> StepSurroundings::accesses_of(const Stmt& step) {
  auto [known, is_new] = found_.try_emplace(step.get(), step, std::vector<Access>());
  if (is_new) known->second.second = AccessFinder(step).found;
  std::vector<Access> result = known->second.second;
  for (Access& access : result) {
    if (!access.elements.is_bounded()) continue;
    access.elements = without_loads({expand_lets_in_scope(access.elements.min, lets_),
                                     expand_lets_in_scope(access.elements.max, lets_)});
  }
  return result;
}

Access StepSurroundings::one_iteration_earlier(const Access& access, const For& loop) {
  if (!access.elements.is_bounded()) return access;
  const auto earlier = [&](const Expr& end) {
    return substitute(end, loop.name, variable(loop.name) - 1);
  };
  return {access.name, access.stores, {earlier(access.elements.min), earlier(access.elements.max)}};
}

Access StepSurroundings::in_any_iteration(const Access& access, const For& loop) const {
  if (!access.elements.is_bounded()) return access;
  Ranges ranges;
  ranges.push(loop.name, range_of(loop));
  return {access.name, access.stores,
          without_loads({analysis::bounds_of(access.elements.min, ranges).min,
                         analysis::bounds_of(access.elements.max, ranges).max})};
}

bool StepSurroundings::can_prove_runs(const For& loop) {
  return can_prove_below(0, expand_lets_in_scope(loop.extent, lets_));
}

bool StepSurroundings::can_prove_below(const Expr& a, const Expr& b) {
  if (a.type() != b.type()) return false;
  const Expr difference = simplify(b - a);
  return std::max(facts_.range(difference).min, facts_.lower_bound(ir::sum_of(difference))) > 0;
}

bool StepSurroundings::can_prove_apart(const Interval& a, const Interval& b) {
  return can_prove_below(a.max, b.min) || can_prove_below(b.max, a.min);
}

// Folded storage (fold_storage) is indexed by remainders of a loop variable. To tell such accesses apart, all
// remainders are tried.
bool StepSurroundings::can_prove_apart(const Access& a, const Access& b) {
  if (!a.elements.is_bounded() || !b.elements.is_bounded()) return false;
  if (can_prove_apart(a.elements, b.elements)) return true;
  constexpr int64_t most_remainders = 16;
  for (const For* loop : loops_) {
    int64_t divisor = 1;
    for (const Interval& elements : {a.elements, b.elements}) {
      find_divisors(elements.min, loop->name, divisor);
      find_divisors(elements.max, loop->name, divisor);
    }
    if (divisor == 1 || divisor > most_remainders) continue;
    const auto are_apart_at = [&](int remainder) {
      const Expr value = variable(loop->name + ".turn") * static_cast<int>(divisor) + remainder;
      const auto at = [&](const Interval& elements) {
        return Interval{substitute(elements.min, loop->name, value),
                        substitute(elements.max, loop->name, value)};
      };
      return can_prove_apart(at(a.elements), at(b.elements));
    };
    bool are_apart = true;
    for (int r = 0; are_apart && r < divisor; ++r) are_apart = are_apart_at(r);
    if (are_apart) return true;
  }
  return false;
}

}  // namespace retrograde::lower
