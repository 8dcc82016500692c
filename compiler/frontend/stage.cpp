// stage.cpp -- scheduling directives. Each lists its legality conditions as numbered checks, then
// writes the schedule.
#include "frontend/stage.h"

#include <algorithm>
#include <unordered_set>

#include "graph/associative_update.h"
#include "graph/define.h"
#include "graph/directive.h"
#include "graph/race.h"
#include "ir/print.h"

namespace retrograde {

namespace {

std::string loops_of(const ir::StageSchedule& schedule) {
  std::string out;
  for (auto dim = schedule.dims.rbegin(); dim != schedule.dims.rend(); ++dim) {
    out += (out.empty() ? "" : ", ") + quoted(dim->var);
  }
  return out.empty() ? "it has no loops" : "its loops are, outermost first, " + out;
}

// What became of a variable that is no loop any more; empty when it never was one.
std::string fate_of(const ir::StageSchedule& schedule, const std::string& var) {
  for (const ir::Split& split : schedule.splits) {
    switch (split.kind) {
      case ir::Split::Kind::Split:
        if (split.old_var != var) continue;
        return text(quoted(var), " was split into ", quoted(split.outer), " and ",
                    quoted(split.inner));
      case ir::Split::Kind::Fuse:
        if (split.outer != var && split.inner != var) continue;
        return text(quoted(var), " was fused into ", quoted(split.old_var));
      case ir::Split::Kind::Rename:
        if (split.old_var != var) continue;
        return text(quoted(var), " was renamed to ", quoted(split.outer));
    }
  }
  return "";
}

// The reduction variables that a loop was made of.
std::unordered_set<std::string> reduction_roots(const ir::Definition& definition,
                                                const ir::StageSchedule& schedule,
                                                const std::string& loop) {
  std::unordered_set<std::string> names{loop};
  const auto& splits = schedule.splits;
  for (auto split = splits.rbegin(); split != splits.rend(); ++split) {
    if (split->kind == ir::Split::Kind::Fuse) {
      if (names.erase(split->old_var)) names.insert({split->outer, split->inner});
    } else if (names.erase(split->outer) + names.erase(split->inner) > 0) {
      names.insert(split->old_var);
    }
  }
  std::unordered_set<std::string> roots;
  for (const ir::ReductionVariable& rvar : definition.rvars) {
    if (names.count(rvar.var)) roots.insert(rvar.var);
  }
  return roots;
}

void check_factor(const Expr& factor, const std::string& asked) {
  if (!factor.defined())
    user_error(asked, "the factor must be a defined expression", "it was never assigned",
               "Assign every Expr before it is used");
  if (!factor.type().is_int_or_uint() || !factor.type().is_scalar()) {
    user_error(asked, "a factor is an integer",
               text(factor, " has type ", to_string(factor.type())), "Give an integer");
  }
  ir::check_over_parameters(factor, "a factor", asked);
  auto constant = ir::as_const_int(factor);
  if (constant && *constant <= 0) {
    user_error(asked, "a factor is at least 1", text("it is ", *constant),
               "Give a positive factor");
  }
  if (constant && *constant > INT32_MAX) {
    user_error(asked, "a factor fits an int32", text("it is ", *constant), "Give a smaller factor");
  }
}

void check_tail(TailStrategy tail, bool is_update, bool is_reduction, const std::string& asked) {
  const bool exact = tail == TailStrategy::Auto || tail == TailStrategy::GuardWithIf ||
                     tail == TailStrategy::Predicate;
  if (is_reduction && !exact) {
    user_error(asked, "a loop over a reduction variable runs exactly over its domain",
               "this tail strategy would run points twice or beyond it",
               "Use TailStrategy::GuardWithIf or TailStrategy::Auto");
  }
  if (is_update && tail == TailStrategy::ShiftInwards) {
    user_error(asked, "an update definition does not run a point twice",
               "TailStrategy::ShiftInwards would, at the end of the range",
               "Use TailStrategy::GuardWithIf or TailStrategy::RoundUp");
  }
}

// Whether what lies behind the end of a loop belongs to no other iteration. Behind the end of an
// inner loop lie the points of the next iteration around it.
bool ends_alone(const ir::StageSchedule& schedule, std::string loop) {
  for (auto split = schedule.splits.rbegin(); split != schedule.splits.rend(); ++split) {
    if (split->kind == ir::Split::Kind::Fuse) {
      if (split->old_var == loop) loop = split->outer;
    } else if (split->outer == loop) {
      loop = split->old_var;
    } else if (split->kind == ir::Split::Kind::Split && split->inner == loop) {
      return false;
    }
  }
  return true;
}

// Whether the loop is an inner one of constant extent that the factor divides: then it has no tail.
bool divides_inner(const ir::StageSchedule& schedule, const std::string& loop, const Expr& factor) {
  const auto small = ir::as_const_int(factor);
  for (auto split = schedule.splits.rbegin(); split != schedule.splits.rend(); ++split) {
    if (split->kind == ir::Split::Kind::Rename || split->inner != loop) continue;
    const auto large = split->kind == ir::Split::Kind::Split ? ir::as_const_int(split->factor)
                                                             : std::optional<int64_t>();
    return small && large && *large % *small == 0;
  }
  return false;
}

void check_round_up(const ir::StageSchedule& schedule, const std::string& loop, const Expr& factor,
                    const std::string& asked) {
  if (ends_alone(schedule, loop) || divides_inner(schedule, loop, factor)) return;
  user_error(asked, "an update definition does not run a point twice",
             text("TailStrategy::RoundUp runs ", quoted(loop),
                  " past its end, into the points of the next iteration around it"),
             "Use TailStrategy::GuardWithIf, or a factor that divides the loop's extent");
}

// Whoever stores beyond the range writes back what was there: to leave it alone is the same.
TailStrategy without_blending(TailStrategy tail) {
  const bool blends =
      tail == TailStrategy::RoundUpAndBlend || tail == TailStrategy::ShiftInwardsAndBlend;
  return blends ? TailStrategy::PredicateStores : tail;
}

// The variable that makes a loop's iterations depend on each other; empty when none does.
std::string dependent_root(const ir::FuncContents& f, const ir::Definition& definition,
                           const ir::StageSchedule& schedule, const std::string& loop) {
  for (const std::string& root : reduction_roots(definition, schedule, loop)) {
    if (!ir::can_prove_race_free(f, definition, root)) return root;
  }
  return "";
}

// Reduction loops keep their order, unless it does not matter: the update is proven to commute. A
// loop whose iterations touch different elements may go anywhere.
void check_reduction_order(const ir::FuncContents& f, const ir::Definition& definition,
                           const ir::StageSchedule& now, const std::vector<ir::Dim>& dims,
                           const std::string& asked) {
  const auto dependent_loops = [&](const std::vector<ir::Dim>& all) {
    std::vector<std::string> order;
    for (const ir::Dim& dim : all) {
      if (dim.is_reduction && !dependent_root(f, definition, now, dim.var).empty())
        order.push_back(dim.var);
    }
    return order;
  };
  const std::vector<std::string> before = dependent_loops(now.dims), after = dependent_loops(dims);
  if (before == after || ir::can_prove_commutative(f, definition)) return;
  size_t i = 0;
  while (before[i] == after[i]) i++;
  user_error(asked, "the order of reduction loops may change only where it changes no result",
             text("the update of ", quoted(f.name), " over ",
                  quoted(dependent_root(f, definition, now, after[i])),
                  " is neither an accumulation nor independent from point to point"),
             "Keep the reduction loops in their order; pure loops may go anywhere");
}

// One element is updated as one, and no more: another iteration may write the others at any time.
void check_atomic_reads(const ir::FuncContents& f, const ir::Definition& update,
                        const std::string& asked) {
  const Expr other = ir::read_of_other_element(f, update);
  if (!other.defined()) return;
  user_error(asked, "an atomic update reads no element of its Func but the one that it writes",
             text("it reads ", other, ", which another iteration may write"),
             "Keep the loop serial, or compute what is read in another Func");
}

std::string names_of(const std::vector<VarOrRVar>& vars) {
  std::string out;
  for (const VarOrRVar& var : vars) out += (out.empty() ? "" : ", ") + quoted(var.name());
  return out;
}

}  // namespace

std::string Stage::name() const { return ir::stage_name(*func_, index_); }

std::string Stage::source_location() const { return ir::source_location_of(*func_); }

std::string Stage::dump_argument_list() const {
  std::string out;
  for (const ir::Dim& dim : get_schedule().dims) out += (out.empty() ? "" : ", ") + dim.var;
  return out;
}

size_t Stage::loop_index(const VarOrRVar& var, const std::string& asked) const {
  const ir::StageSchedule& now = schedule();
  for (size_t i = 0; i < now.dims.size(); i++) {
    if (now.dims[i].var == var.name()) return i;
  }
  const std::string fate = fate_of(now, var.name());
  user_error(asked, text(quoted(var.name()), " must be a loop of this stage"),
             fate.empty() ? loops_of(now) : fate + "; " + loops_of(now), "Name one of its loops");
}

void Stage::check_new_name(const VarOrRVar& var, const std::string& replaced,
                           const std::string& asked) const {
  const std::string& name = var.name();
  if (name == replaced) return;
  const ir::StageSchedule& now = schedule();
  const bool is_loop = std::any_of(now.dims.begin(), now.dims.end(),
                                   [&](const ir::Dim& dim) { return dim.var == name; });
  if (!is_loop) return;
  user_error(asked, "the loops of a stage have different names",
             text(quoted(name), " is a loop already; ", loops_of(now)), "Use another Var");
}

// Iterations that may touch the same element need atomic() of an update that is proven associative
// and commutative, atomic(true), or allow_race_conditions().
void Stage::check_race_free(const VarOrRVar& var, const std::string& asked) const {
  const ir::Definition& stage = definition();
  const ir::StageSchedule& now = schedule();
  if (now.allow_races) return;
  for (const std::string& root : reduction_roots(stage, now, var.name())) {
    if (ir::can_prove_race_free(*func_, stage, root)) continue;
    if (now.atomic) {
      check_atomic_reads(*func_, stage, asked);
      if (now.override_associativity) continue;
      const ir::AssociativityProof update = ir::prove_associative(*func_, stage);
      if (update.op && update.op->commutative) return;
      user_error(asked, "an atomic update is associative and commutative",
                 update.op ? update.why_not_commutative : update.why_not,
                 "Give atomic(true) if its order does not matter, or keep the loop serial");
    }
    std::string pure;
    for (const ir::Dim& dim : now.dims) {
      if (!dim.is_reduction) pure += (pure.empty() ? "" : " or ") + quoted(dim.var);
    }
    user_error(
        asked, "iterations that run at the same time must not touch the same element",
        text(quoted(root),
             " is a reduction variable, and its iterations may read or write one element of ",
             quoted(func_->name)),
        text(pure.empty() ? "Reduce into more elements first, with rfactor"
                          : "Use " + pure + " instead: its iterations are independent",
             "; or make the update atomic(), or allow_race_conditions()"));
  }
}

Stage& Stage::atomic(bool override_associativity_test) {
  ir::StageSchedule& now = touch();
  now.atomic = true;
  now.override_associativity = override_associativity_test;
  return *this;
}

void Stage::unscheduled() { touch(); }

std::vector<VarOrRVar> Stage::split_vars() const {
  std::vector<VarOrRVar> vars;
  for (const ir::Dim& dim : schedule().dims) vars.emplace_back(dim.var, dim.is_reduction);
  return vars;
}

Stage& Stage::allow_race_conditions() {
  touch().allow_races = true;
  return *this;
}

Stage& Stage::split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
                    const Expr& factor, TailStrategy tail) {
  const std::string asked = text("split ", quoted(old.name()), " of ", quoted(name()), " into ",
                                 quoted(outer.name()), " and ", quoted(inner.name()));
  // 1. The loop exists. 2. The new names differ and are new. 3. The factor is positive. 4. The tail
  // fits the stage.
  const size_t at = loop_index(old, asked);
  if (outer.name() == inner.name()) {
    user_error(asked, "the two new loops have different names", "both are " + quoted(outer.name()),
               "Use another Var");
  }
  check_new_name(outer, old.name(), asked);
  check_new_name(inner, old.name(), asked);
  check_factor(factor, asked);
  const bool is_reduction = schedule().dims[at].is_reduction;
  tail = without_blending(tail);
  check_tail(tail, index_ > 0, is_reduction, asked);
  if (index_ > 0 && tail == TailStrategy::RoundUp)
    check_round_up(schedule(), old.name(), factor, asked);

  ir::apply_directive(
      ir::SplitLoop{old.name(), outer.name(), inner.name(), ir::cast_to(Int(32), factor), tail},
      touch());
  return *this;
}

Stage& Stage::fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused) {
  const std::string asked =
      text("fuse ", quoted(inner.name()), " and ", quoted(outer.name()), " of ", quoted(name()));
  // 1. Both loops exist and differ. 2. The fused name is new. 3. The outer loop may stand directly
  // around the inner one.
  size_t inner_at = loop_index(inner, asked), outer_at = loop_index(outer, asked);
  if (inner_at == outer_at)
    user_error(asked, "it takes two loops", "both are " + quoted(inner.name()), "Name two loops");
  if (fused.name() != outer.name()) check_new_name(fused, inner.name(), asked);
  if (outer_at != inner_at + 1) {
    std::vector<ir::Dim> dims = schedule().dims;
    const ir::Dim moved = dims[outer_at];
    dims.erase(dims.begin() + outer_at);
    if (outer_at < inner_at) inner_at--;
    outer_at = inner_at + 1;
    dims.insert(dims.begin() + outer_at, moved);
    check_reduction_order(*func_, definition(), schedule(), dims, asked);
    touch().dims = std::move(dims);
  }
  ir::StageSchedule& schedule = touch();
  const ir::Dim inner_dim = schedule.dims[inner_at], outer_dim = schedule.dims[outer_at];
  ir::Split split;
  split.kind = ir::Split::Kind::Fuse;
  split.old_var = fused.name();
  split.outer = outer.name();
  split.inner = inner.name();
  split.exact = inner_dim.is_reduction || outer_dim.is_reduction;
  schedule.dims[inner_at] = {fused.name(), outer_dim.for_type, split.exact, outer_dim.partition};
  schedule.dims.erase(schedule.dims.begin() + outer_at);
  schedule.splits.push_back(std::move(split));
  return *this;
}

Stage& Stage::rename(const VarOrRVar& old_name, const VarOrRVar& new_name) {
  const std::string asked = text("rename ", quoted(old_name.name()), " of ", quoted(name()), " to ",
                                 quoted(new_name.name()));
  loop_index(old_name, asked);
  check_new_name(new_name, old_name.name(), asked);
  if (old_name.name() == new_name.name()) return *this;
  ir::apply_directive(ir::RenameLoop{old_name.name(), new_name.name()}, touch());
  return *this;
}

Stage& Stage::reorder(const std::vector<VarOrRVar>& vars) {
  const std::string asked = text("reorder ", names_of(vars), " of ", quoted(name()));
  // 1. Every loop exists. 2. None is named twice. 3. Reduction loops keep their order, unless it
  // does not matter.
  std::vector<size_t> places;
  for (const VarOrRVar& var : vars) places.push_back(loop_index(var, asked));
  std::vector<size_t> sorted = places;
  std::sort(sorted.begin(), sorted.end());
  for (size_t i = 0; i < vars.size(); i++) {
    if (std::count(places.begin(), places.end(), places[i]) > 1) {
      user_error(asked, "each loop is named once", quoted(vars[i].name()) + " is named twice",
                 "Drop one of them");
    }
  }
  std::vector<ir::Dim> dims = schedule().dims;
  for (size_t i = 0; i < sorted.size(); i++) dims[sorted[i]] = schedule().dims[places[i]];

  check_reduction_order(*func_, definition(), schedule(), dims, asked);
  touch().dims = std::move(dims);
  return *this;
}

Stage& Stage::set_for_type(const VarOrRVar& var, ForType type, const char* verb) {
  const std::string asked = text(verb, " ", quoted(name()), " over ", quoted(var.name()));
  const size_t at = loop_index(var, asked);
  if (type == ForType::Parallel || type == ForType::Vectorized) check_race_free(var, asked);
  touch().dims[at].for_type = type;
  return *this;
}

Stage& Stage::serial(const VarOrRVar& var) {
  return set_for_type(var, ForType::Serial, "serialize");
}
Stage& Stage::parallel(const VarOrRVar& var) {
  return set_for_type(var, ForType::Parallel, "parallelize");
}
Stage& Stage::vectorize(const VarOrRVar& var) {
  return set_for_type(var, ForType::Vectorized, "vectorize");
}
Stage& Stage::unroll(const VarOrRVar& var) {
  return set_for_type(var, ForType::Unrolled, "unroll");
}

// ---- partition control ----

Stage& Stage::partition(const VarOrRVar& var, Partition partition) {
  const size_t at = loop_index(
      var, text("choose how to partition the loop ", quoted(var.name()), " of ", quoted(name())));
  touch().dims[at].partition = partition;
  return *this;
}

Stage& Stage::never_partition(const std::vector<VarOrRVar>& vars) {
  for (const VarOrRVar& var : vars) partition(var, Partition::Never);
  return *this;
}

Stage& Stage::always_partition(const std::vector<VarOrRVar>& vars) {
  for (const VarOrRVar& var : vars) partition(var, Partition::Always);
  return *this;
}

Stage& Stage::never_partition_all() {
  for (ir::Dim& dim : touch().dims) dim.partition = Partition::Never;
  return *this;
}

Stage& Stage::always_partition_all() {
  for (ir::Dim& dim : touch().dims) dim.partition = Partition::Always;
  return *this;
}

// ---- split and run ----

namespace {
VarOrRVar fresh_like(const VarOrRVar& var) {
  return var.is_rvar ? VarOrRVar(RVar()) : VarOrRVar(Var());
}
}  // namespace

Stage& Stage::parallel(const VarOrRVar& var, const Expr& task_size, TailStrategy tail) {
  loop_index(var, text("parallelize ", quoted(name()), " over ", quoted(var.name())));
  check_race_free(var, text("parallelize ", quoted(name()), " over ", quoted(var.name())));
  return split(var, var, fresh_like(var), task_size, tail).parallel(var);
}

Stage& Stage::vectorize(const VarOrRVar& var, const Expr& factor, TailStrategy tail) {
  loop_index(var, text("vectorize ", quoted(name()), " over ", quoted(var.name())));
  check_race_free(var, text("vectorize ", quoted(name()), " over ", quoted(var.name())));
  const VarOrRVar lanes = fresh_like(var);
  return split(var, var, lanes, factor, tail).vectorize(lanes);
}

Stage& Stage::unroll(const VarOrRVar& var, const Expr& factor, TailStrategy tail) {
  const VarOrRVar copies = fresh_like(var);
  return split(var, var, copies, factor, tail).unroll(copies);
}

Stage& Stage::tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xo, const VarOrRVar& yo,
                   const VarOrRVar& xi, const VarOrRVar& yi, const Expr& xfactor,
                   const Expr& yfactor, TailStrategy tail) {
  return split(x, xo, xi, xfactor, tail).split(y, yo, yi, yfactor, tail).reorder(xi, yi, xo, yo);
}

Stage& Stage::tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xi, const VarOrRVar& yi,
                   const Expr& xfactor, const Expr& yfactor, TailStrategy tail) {
  return tile(x, y, x, y, xi, yi, xfactor, yfactor, tail);
}

Stage& Stage::tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
                   const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
                   const std::vector<TailStrategy>& tails) {
  const size_t count = previous.size();
  if (outers.size() != count || inners.size() != count || factors.size() != count ||
      tails.size() != count) {
    user_error(
        text("tile ", names_of(previous), " of ", quoted(name())), "all lists have one length",
        text("they have ", count, " loops, ", outers.size(), " outer and ", inners.size(),
             " inner names, ", factors.size(), " factors and ", tails.size(), " tail strategies"),
        "Give lists of one length");
  }
  for (size_t i = 0; i < count; i++) split(previous[i], outers[i], inners[i], factors[i], tails[i]);
  std::vector<VarOrRVar> order = inners;
  order.insert(order.end(), outers.begin(), outers.end());
  return reorder(order);
}

Stage& Stage::tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
                   const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
                   TailStrategy tail) {
  return tile(previous, outers, inners, factors, std::vector<TailStrategy>(previous.size(), tail));
}

Stage& Stage::tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& inners,
                   const std::vector<Expr>& factors, TailStrategy tail) {
  return tile(previous, previous, inners, factors, tail);
}

}  // namespace retrograde
