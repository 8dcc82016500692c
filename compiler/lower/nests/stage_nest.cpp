#include "lower/nests/stage_nest.h"

#include <optional>

#include "diagnostics/error.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/own_joining.h"
#include "lower/program.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

Interval Loop::range() const { return {min, simplify(min + extent - 1)}; }

namespace {

// How a variable that was fused away is recovered from the fused variable. The fused variable may have the same name:
// vectorize(x, 8) replaces x by an outer x and an inner loop.
struct Fused {
  std::string fused;  // the variable that replaced outer and inner
  Range outer, inner;
  bool is_outer = false;  // whether this describes outer or inner
};

// A split with a guarded tail: no iteration of the outer loop begins beyond the end.
struct Tail {
  std::string outer, inner;
  Expr outer_extent;
  Expr first, last;  // the bounds of an iteration of the outer loop
};

struct Derived {
  std::string var;
  Expr value;          // in terms of the variables that replaced it
  Expr guarded_value;  // the same, clamped where a guard applies
  Expr guard;          // likewise; undefined if there is none
  std::optional<Fused> fused;
  std::optional<Tail> tail = {};
};

// Whether the Func has storage of its own that grows with the region its loops access.
bool has_growing_storage(const LoopedFunc& f) {
  return !f.is_output && !f.func->is_extern() && !f.schedule.memoized && !f.schedule.async &&
         is_stored_where_computed(f);
}

// Whether a definition reads nothing. Its tiles may run beyond the end of the region: they then begin where the tiles
// of updates begin, and register tiles have constant indices, at the border, too.
bool reads_nothing(const Definition& definition) {
  return !any_node(definition, [](const Call& call) {
    return call.call_type != CallType::Operator || op_info(call.op).cls == OpClass::Effect;
  });
}

class NestBuilder {
 public:
  NestBuilder(const LoopedFunc& f, int stage, const Domain& domain)
      : definition_(f.stages[stage]),
        prefix_(stage_prefix(f.name(), stage)),
        is_update_(stage > 0),
        hosts_updates_(hosts_own_updates(f, stage)),
        may_run_past_the_end_(stage == 0 && !hosts_updates_ && has_growing_storage(f) &&
                              reads_nothing(definition_)),
        ranges_(domain) {}

  StageNest build() {
    for (const Split& split : definition_.schedule.splits) apply(split);
    StageNest nest;
    for (const Dim& dim : definition_.schedule.dims) nest.loops.push_back(loop_of(dim));
    nest.rounds_up = rounds_up_;
    resolve(nest);
    return nest;
  }

 private:
  const Definition& definition_;
  const std::string prefix_;
  const bool is_update_, hosts_updates_, may_run_past_the_end_;
  bool rounds_up_ = false;
  Domain ranges_;  // of every variable that exists after the splits so far
  std::vector<std::vector<Derived>>
      derived_;  // one step per split, with the variables that it derives

  Expr loop_variable(const std::string& var) const { return variable(prefix_ + var); }

  Loop loop_of(const Dim& dim) const {
    if (dim.var == outermost_loop)
      return {dim.var, prefix_ + dim.var, 0, 1, dim.runs, dim.partition, {}};
    auto it = ranges_.find(dim.var);
    RETROGRADE_ASSERT(it != ranges_.end(), "loop over a variable that does not exist: " + dim.var);
    return {dim.var, prefix_ + dim.var, it->second.min, it->second.extent, dim.runs, dim.partition,
            {}};
  }

  void apply(const Split& split) {
    switch (split.kind) {
      case Split::Kind::Split:
        return apply_split(split);
      case Split::Kind::Fuse:
        return apply_fuse(split);
      case Split::Kind::Rename:
        ranges_[split.outer] = ranges_.at(split.old_var);
        return derive(split.old_var, loop_variable(split.outer));
    }
  }

  void derive(const std::string& var, const Expr& value) {
    derived_.push_back({{var, value, value, {}, {}}});
  }

  TailStrategy tail_of(const Split& split, const Expr& extent) const {
    if (is_zero(simplify(extent % split.factor))) return TailStrategy::RoundUp;  // there is no tail
    if (split.tail != TailStrategy::Auto) return split.tail;
    if (may_run_past_the_end_) return TailStrategy::RoundUp;
    // An update may read the elements that it writes, so each point of it must run once. The same holds for a stage
    // whose loops an update has joined.
    const bool runs_once = is_update_ || hosts_updates_ || split.exact;
    return runs_once ? TailStrategy::GuardWithIf : TailStrategy::ShiftInwards;
  }

  void apply_split(const Split& split) {
    const Range old = ranges_.at(split.old_var);
    Expr factor = cast(Int(32), split.factor);
    ranges_[split.outer] = {0, simplify((old.extent + factor - 1) / factor)};
    ranges_[split.inner] = {0, factor};
    Expr base = loop_variable(split.outer) * factor;
    Expr inner = loop_variable(split.inner);
    switch (tail_of(split, old.extent)) {
      case TailStrategy::RoundUp:
        rounds_up_ = rounds_up_ || !is_zero(simplify(old.extent % factor));
        return derive(split.old_var, base + inner + old.min);
      case TailStrategy::ShiftInwards:
        // If the extent is smaller than the factor, the only block begins before the domain.
        rounds_up_ = rounds_up_ || !can_prove(old.extent >= factor);
        base = min(likely(base), old.extent - factor);
        return derive(split.old_var, base + inner + old.min);
      default: {  // GuardWithIf and its predicated forms
        const Expr last = old.extent - 1;
        const Tail tail{split.outer, split.inner, ranges_[split.outer].extent, base + old.min,
                        last + old.min};
        derived_.push_back({{split.old_var,
                             base + inner + old.min,
                             min(base + inner, last) + old.min,
                             likely(base + inner < old.extent),
                             {},
                             tail}});
      }
    }
  }

  // Recovers the outer variable by division and the inner one by remainder.
  void apply_fuse(const Split& split) {
    const Range outer = ranges_.at(split.outer), inner = ranges_.at(split.inner);
    ranges_[split.old_var] = {0, simplify(outer.extent * inner.extent)};
    Expr fused = loop_variable(split.old_var);
    Expr inner_value = fused % inner.extent + inner.min,
         outer_value = fused / inner.extent + outer.min;
    derived_.push_back(
        {{split.outer, outer_value, outer_value, {}, Fused{split.old_var, outer, inner, true}},
         {split.inner, inner_value, inner_value, {}, Fused{split.old_var, outer, inner, false}}});
  }

  Interval reached(const std::string& var, const Substitution& guarded) const {
    Scope<Interval> loops;
    for (const Dim& dim : definition_.schedule.dims)
      loops.push(prefix_ + dim.var, loop_of(dim).range());
    return bounds_of(substitute(loop_variable(var), guarded), loops);
  }

  // Clamps the part of a guarded split for bounds inference, which does not know that a part begins inside the range if
  // outer and inner variable are in range. The region that the part needs then begins at a multiple of the factor, too.
  // (A variable that is split again and shifted inwards may begin before its range.)
  Expr within_tail(const Tail& tail, const Expr& value, const Substitution& guarded) const {
    const Interval outer = reached(tail.outer, guarded), inner = reached(tail.inner, guarded);
    if (!outer.is_bounded() || !inner.is_bounded()) return value;
    if (!can_prove(outer.max < tail.outer_extent) || !can_prove(inner.min >= 0)) return value;
    return call_op(Op::promise_clamped, Int(32),
                   {value, simplify(substitute(tail.first, guarded)), simplify(tail.last)});
  }

  // Interval arithmetic cannot divide by a symbolic extent. But if a fused variable is in range, the variables
  // recovered from it are in range; if a tail takes it out of range, they leave theirs in proportion.
  Expr within_fused_range(const Fused& from, const Expr& value, const Substitution& guarded) const {
    const Interval fused = reached(from.fused, guarded);
    const Range& own = from.is_outer ? from.outer : from.inner;
    Expr first = own.min, last = own.min + own.extent - 1;
    if (from.is_outer && fused.is_bounded()) {
      if (!can_prove(fused.min >= 0)) first = own.min + fused.min / from.inner.extent;
      if (!can_prove(fused.max < from.outer.extent * from.inner.extent))
        last = own.min + fused.max / from.inner.extent;
    }
    return call_op(Op::promise_clamped, Int(32), {value, simplify(first), simplify(last)});
  }

  // Later derivations replace variables that earlier ones introduced, so they are resolved from the last to the first.
  // At each step `values` holds the values of the variables that exist after that split: a fused variable may have the
  // name of one that it replaced, which has the other meaning before the split.
  void resolve(StageNest& nest) {
    Substitution values, guarded;
    for (auto step = derived_.rbegin(); step != derived_.rend(); ++step) {
      Substitution values_before = values, guarded_before = guarded;
      for (const Derived& d : *step) {
        if (d.guard.defined()) nest.guards.push_back(simplify(substitute(d.guard, values)));
        values_before[prefix_ + d.var] = simplify(substitute(d.value, values));
        Expr value = simplify(substitute(d.guarded_value, guarded));
        if (d.fused) value = within_fused_range(*d.fused, value, guarded);
        if (d.tail) value = within_tail(*d.tail, value, guarded);
        guarded_before[prefix_ + d.var] = value;
      }
      values = std::move(values_before);
      guarded = std::move(guarded_before);
    }
    auto value_in = [&](const Substitution& map, const std::string& var) {
      auto it = map.find(prefix_ + var);
      return it == map.end() ? loop_variable(var) : it->second;
    };
    for (const auto& [var, range] : ranges_) {
      nest.coordinate[var] = value_in(values, var);
      nest.guarded_coordinate[var] = value_in(guarded, var);
    }
  }
};

}  // namespace

StageNest build_stage_nest(const LoopedFunc& f, int stage, const Domain& domain) {
  return NestBuilder(f, stage, domain).build();
}

bool covers_exactly(const LoopedFunc& f, int stage, const std::string& var, const Expr& extent) {
  for (const StageLoops& special : f.stages[stage].schedule.specializations) {
    LoopedFunc variant = f;
    variant.stages[stage].schedule = special;
    if (!covers_exactly(variant, stage, var, extent)) return false;
  }
  Domain domain;
  for (const std::string& arg : f.func->args)
    domain[arg] = {variable(arg + ".first"), variable(arg + ".extent")};
  for (const ReductionVariable& r : f.stages[stage].rvars)
    domain[r.var] = {cast(Int(32), r.min), cast(Int(32), r.extent)};
  const Expr first = domain[var].min;
  domain[var].extent = extent;
  StageNest nest = build_stage_nest(f, stage, domain);
  Scope<Interval> loops;
  for (const Loop& loop : nest.loops) loops.push(loop.name, loop.range());
  Interval reached = bounds_of(nest.guarded_coordinate.at(var), loops);
  BoundsMap facts;
  walk(extent, [&](const Variable& name) { facts[name.name] = {1, {}}; });
  return reached.is_bounded() && can_prove(reached.min >= first, facts) &&
         can_prove(reached.max < first + extent, facts);
}

Expr alignment_of(const LoopedFunc& f, size_t dimension) {
  for (const Bound& bound : f.schedule.bounds) {
    if (bound.var == f.func->args[dimension] && bound.modulus.defined() &&
        bound.remainder.defined())
      return bound.modulus;
  }
  return 1;
}

bool runs_beyond_regions(const LoopedFunc& f, size_t dimension) {
  const Expr extent = variable("region.extent") * alignment_of(f, dimension);
  for (size_t s = 0; s < f.stages.size(); s++) {
    if (!covers_exactly(f, static_cast<int>(s), f.func->args[dimension], extent)) return true;
  }
  return false;
}

}  // namespace retrograde::lower
