#include "lower/loops/step_nests.h"

#include <algorithm>
#include <vector>

#include "analysis/linear.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "lower/walk_in_bounds.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

class StepNestFinder {
 public:
  StepNestFinder(const For& loop, const LetValues& value, SlicesByFunc& slices)
      : value_(value), slices_(slices) {
    const Expr first = simplify(value_(loop.min));
    steps_range_ = {first, simplify(first + value_(loop.extent) - 1)};
  }

  std::optional<StepNest> find(const std::string& func, const Stmt& nest) {
    if (!is_plain(nest)) return std::nullopt;
    const Provide* store = nullptr;
    int stores = 0;
    walk(nest, [&](const Provide& n) {
      if (n.name == func && ++stores == 1) store = &n;
    });
    if (stores != 1) return std::nullopt;
    for (const For* loop : outer_loops(nest)) {
      for (const int sign : {1, -1}) {
        StepNest joined{func, nest, loop, sign, {}};
        if (find_offset(joined) && stores_fit(joined, *store)) return joined;
      }
    }
    return nest_of_one_slice(func, nest, *store);
  }

 private:
  const LetValues& value_;
  SlicesByFunc& slices_;
  Interval steps_range_;

  // The loops that an iteration over time may be taken from: those outside of storage of the nest's own.
  static std::vector<const For*> outer_loops(const Stmt& nest) {
    std::vector<const For*> loops;
    walk(
        nest, [](const Expr&) { return false; },
        [&](const Stmt& s) {
          if (s.as<Realize>()) return false;
          const auto* loop = s.as<For>();
          if (loop && (loop->runs == ForType::Serial || loop->runs == ForType::Parallel))
            loops.push_back(loop);
          return true;
        });
    return loops;
  }

  static bool is_plain(const Stmt& nest) {
    return !any_stmt(nest, [](const Stmt& s) {
      const auto* loop = s.as<For>();
      const bool runs_plainly =
          loop && (loop->runs == ForType::Serial || loop->runs == ForType::Parallel ||
                   loop->runs == ForType::Vectorized || loop->runs == ForType::Unrolled);
      return !runs_plainly && !s.as<LetStmt>() && !s.as<IfThenElse>() && !s.as<Block>() &&
             !s.as<Realize>() && !s.as<ProducerConsumer>() && !s.as<Provide>();
    });
  }

  // A nest that adds to one slice of a Func, in the step that finishes this slice.
  std::optional<StepNest> nest_of_one_slice(const std::string& func, const Stmt& nest,
                                            const Provide& store) {
    const auto own = slices_.find(func);
    if (own == slices_.end()) return std::nullopt;
    const Expr slice = value_(store.args[own->second.dimension]);
    StepNest joined{func, nest, nullptr, 1, {}};
    joined.offset = simplify((slice - own->second.offset) * own->second.sign);
    bool fits = !uses_loops(slice, nest);
    const auto on_expr = [&](const Expr& e, const Scope<Interval>& scope) {
      walk(ir::without_lets(e), [&](const Call& call) {
        const auto found = slices_.find(call.call_type == CallType::Func ? call.name : "");
        if (found == slices_.end() || !fits) return;
        Slices& slices = found->second;
        const Expr read = value_(call.args[slices.dimension]);
        const Expr age = joined.offset - (read - slices.offset) * slices.sign;
        const Interval range = bounds_of(simplify(age), scope);
        const auto min = range.min.defined() ? as_const_int(simplify(range.min)) : std::nullopt;
        const auto max = range.max.defined() ? as_const_int(simplify(range.max)) : std::nullopt;
        const int64_t most = call.name == func ? 0 : most_step_slots - 1;
        fits = min && max && *min >= 0 && *max <= most;
        if (fits) slices.most_age = std::max(slices.most_age, *max);
      });
    };
    walk_in_bounds(nest, on_expr, [](const Stmt&, const Scope<Interval>&) {});
    return fits ? std::optional(joined) : std::nullopt;
  }

  struct Read {
    Expr step;  // in which the slice is finished, minus sign * (loop over time)
    Slices* slices;
    const Scope<Interval>& scope;
  };
  void for_each_read(const StepNest& nest, FunctionRef<void(const Read&)> visit) {
    const auto on_expr = [&](const Expr& e, const Scope<Interval>& scope) {
      walk(ir::without_lets(e), [&](const Call& call) {
        const auto found = slices_.find(call.call_type == CallType::Func ? call.name : "");
        if (found == slices_.end() || call.name == nest.func) return;
        Slices& slices = found->second;
        const Expr slice = value_(call.args[slices.dimension]);
        const Expr time = variable(nest.over_time->name);
        visit({(slice - slices.offset) * slices.sign - time * nest.sign, &slices, scope});
      });
    };
    walk_in_bounds(nest.nest, on_expr, [](const Stmt&, const Scope<Interval>&) {});
  }

  BoundsMap range_of_loop(const For& loop) const {
    const Expr min = simplify(value_(loop.min));
    return {{loop.name, {min, simplify(min + value_(loop.extent) - 1)}}};
  }

  // Finds the offset such that every slice that an iteration reads is finished, and that the iterations lie in the
  // steps. Notes the ages of the slices.
  bool find_offset(StepNest& nest) {
    const BoundsMap facts = range_of_loop(*nest.over_time);
    const auto ends = [&](const Expr& e, const Scope<Interval>& scope) {
      return bounds_of(simplify(e, facts), scope);
    };
    Expr base;
    for_each_read(nest, [&](const Read& read) {
      if (!base.defined()) base = ends(read.step, read.scope).max;
    });
    if (!base.defined() || uses_loops(base, nest.nest)) return false;
    int64_t latest = INT64_MAX, earliest = INT64_MIN;  // how long before `base` slices are finished
    bool known = true;
    for_each_read(nest, [&](const Read& read) {
      const Interval behind = ends(base - read.step, read.scope);
      const auto min = behind.min.defined() ? as_const_int(simplify(behind.min)) : std::nullopt;
      const auto max = behind.max.defined() ? as_const_int(simplify(behind.max)) : std::nullopt;
      known = known && min && max;
      if (!known) return;
      latest = std::min(latest, *min);
      earliest = std::max(earliest, *max);
    });
    if (!known || earliest - latest >= most_step_slots) return false;
    nest.offset = simplify(base - make_const(Int(32), latest));
    if (!lies_in_steps(nest, facts.at(nest.over_time->name))) return false;
    for_each_read(nest, [&](const Read& read) {
      const auto max = as_const_int(simplify(ends(base - read.step, read.scope).max));
      read.slices->most_age = std::max(read.slices->most_age, *max - latest);
    });
    return true;
  }

  static bool uses_loops(const Expr& e, const Stmt& nest) {
    bool uses = false;
    walk(nest, [&](const For& loop) { uses = uses || uses_variable(e, loop.name); });
    return uses;
  }

  bool lies_in_steps(const StepNest& nest, const Interval& loop) const {
    Expr first = loop.min * nest.sign + nest.offset, last = loop.max * nest.sign + nest.offset;
    if (nest.sign < 0) std::swap(first, last);
    return can_prove(first >= steps_range_.min) && can_prove(last <= steps_range_.max);
  }

  // ---- what a nest stores ----

  // Whether the iterations over time store to slices of their own, or add to elements that they share.
  bool stores_fit(const StepNest& nest, const Provide& store) {
    const std::string& time = nest.over_time->name;
    std::vector<size_t> moved;
    for (size_t d = 0; d < store.args.size(); ++d) {
      if (uses_variable(value_(store.args[d]), time)) moved.push_back(d);
    }
    if (moved.empty()) return adds_up(nest, store);
    if (moved.size() > 1 || slices_.count(nest.func)) return false;
    const auto form = analysis::decompose(value_(store.args[moved[0]]), {time});
    if (!form || form->coefficients.size() != 1 || std::abs(form->coefficients[0].second) != 1 ||
        uses_loops(form->rest, nest.nest) || reads_itself(nest))
      return false;
    // slice = s * time + rest is finished in the step sign * time + offset
    const int s = static_cast<int>(form->coefficients[0].second);
    const int sign = s * nest.sign;
    slices_[nest.func] = {moved[0], sign, simplify(form->rest - nest.offset * sign)};
    return true;
  }

  static bool reads_itself(const StepNest& nest) {
    return any_node(nest.nest, [&](const Call& call) {
      return call.call_type == CallType::Func && call.name == nest.func;
    });
  }

  // g(x) = g(x) + e, where e does not read g. Every element gets its terms in another order.
  bool adds_up(const StepNest& nest, const Provide& store) const {
    const auto is_own = [&](const Call& call) {
      return call.call_type == CallType::Func && call.name == nest.func;
    };
    int own_reads = 0, sums = 0;
    walk(nest.nest, [&](const Call& call) { own_reads += is_own(call); });
    for (size_t i = 0; i < store.values.size(); ++i) {
      const auto* sum = store.values[i].as<Add>();
      const auto* own = sum ? sum->a.as<Call>() : nullptr;
      sums += own && is_own(*own) && own->component == static_cast<int>(i) &&
              same_args(own->args, store.args) && !any_node(sum->b, is_own);
    }
    return sums == static_cast<int>(store.values.size()) && own_reads == sums;
  }
};

}  // namespace

std::optional<StepNest> find_step_nest(const std::string& func, const Stmt& nest, const For& loop,
                                       const LetValues& value, SlicesByFunc& slices) {
  return StepNestFinder(loop, value, slices).find(func, nest);
}

}  // namespace retrograde::lower
