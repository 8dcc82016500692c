// stage.cpp -- what schedules of loops are in terms of directives, which graph/give_directive.h
// checks, applies and logs.
#include "frontend/stage.h"

#include "frontend/func.h"
#include "graph/define.h"
#include "graph/rfactor.h"

namespace retrograde {

namespace {

std::vector<ir::NamedLoop> names_of(const std::vector<VarOrRVar>& vars) {
  std::vector<ir::NamedLoop> names;
  for (const VarOrRVar& var : vars) names.emplace_back(var.name());
  return names;
}

std::string as_list(const std::vector<VarOrRVar>& vars) {
  std::string out;
  for (const VarOrRVar& var : vars) out += (out.empty() ? "" : ", ") + quoted(var.name());
  return out;
}

std::vector<VarOrRVar> loops_of(const ir::StageSchedule& schedule) {
  std::vector<VarOrRVar> loops;
  for (const ir::Dim& dim : schedule.dims) loops.emplace_back(dim.var, dim.is_reduction);
  return loops;
}

}  // namespace

std::string Stage::name() const { return ir::stage_name(*place_.f, place_.stage); }
std::string Stage::source_location() const { return ir::source_location_of(*place_.f); }
std::vector<VarOrRVar> Stage::split_vars() const { return loops_of(get_schedule()); }

std::string Stage::dump_argument_list() const {
  std::string out;
  for (const ir::Dim& dim : get_schedule().dims) out += (out.empty() ? "" : ", ") + dim.var;
  return out;
}

Stage& Stage::give(ir::Directive directive) {
  ir::give_directive(place_, std::move(directive));
  return *this;
}

// ---- one loop or several ----

Stage& Stage::split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
                    const Expr& factor, TailStrategy tail) {
  return give(ir::SplitLoop{old.name(), outer.name(), inner.name(), factor, tail});
}
Stage& Stage::fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused) {
  return give(ir::FuseLoops{inner.name(), outer.name(), fused.name()});
}
Stage& Stage::rename(const VarOrRVar& old_name, const VarOrRVar& new_name) {
  return give(ir::RenameLoop{old_name.name(), new_name.name()});
}
Stage& Stage::reorder(const std::vector<VarOrRVar>& vars) {
  return give(ir::ReorderLoops{names_of(vars)});
}
Stage& Stage::serial(const VarOrRVar& var) {
  return give(ir::RunLoop{var.name(), ForType::Serial});
}
Stage& Stage::parallel(const VarOrRVar& var) {
  return give(ir::RunLoop{var.name(), ForType::Parallel});
}
Stage& Stage::vectorize(const VarOrRVar& var) {
  return give(ir::RunLoop{var.name(), ForType::Vectorized});
}
Stage& Stage::unroll(const VarOrRVar& var) {
  return give(ir::RunLoop{var.name(), ForType::Unrolled});
}

Stage& Stage::partition(const VarOrRVar& var, Partition partition) {
  return give(ir::PartitionLoop{var.name(), partition});
}
Stage& Stage::set_partitions(const std::vector<VarOrRVar>& vars, Partition how) {
  for (const VarOrRVar& var : vars) partition(var, how);
  return *this;
}
Stage& Stage::never_partition(const std::vector<VarOrRVar>& vars) {
  return set_partitions(vars, Partition::Never);
}
Stage& Stage::always_partition(const std::vector<VarOrRVar>& vars) {
  return set_partitions(vars, Partition::Always);
}
Stage& Stage::never_partition_all() { return never_partition(split_vars()); }
Stage& Stage::always_partition_all() { return always_partition(split_vars()); }

// ---- the stage as a whole ----

Stage& Stage::atomic(bool override_associativity_test) {
  return give(ir::MakeAtomic{override_associativity_test});
}
Stage& Stage::allow_race_conditions() { return give(ir::AllowRaces{}); }
void Stage::unscheduled() { give(ir::Unscheduled{}); }

Stage Stage::specialize(const Expr& condition) {
  give(ir::Specialize{condition});
  Stage special = *this;
  special.place_.special.push_back(ir::specialization_for(get_schedule(), condition));
  return special;
}
void Stage::specialize_fail(const std::string& message) { give(ir::SpecializeFail{message}); }

Func Stage::rfactor(const RVar& r, const Var& v) {
  return rfactor(std::vector<std::pair<RVar, Var>>{{r, v}});
}
Func Stage::rfactor(const std::vector<std::pair<RVar, Var>>& preserved) {
  std::vector<std::pair<ir::NamedLoop, std::string>> names;
  for (const auto& [rvar, var] : preserved) names.emplace_back(rvar.name(), var.name());
  return Func(ir::factor_out(place_, names));
}

// ---- company ----

Stage& Stage::compute_with(const LoopLevel& level,
                           const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
  ir::ComputeWith with{{{}, level.contents()}};
  for (const auto& [var, strategy] : align) with.align.emplace_back(var.name(), strategy);
  return give(std::move(with));
}
Stage& Stage::compute_with(const LoopLevel& level, LoopAlignStrategy align) {
  std::vector<std::pair<VarOrRVar, LoopAlignStrategy>> all;
  for (const VarOrRVar& loop : split_vars()) {
    if (align != LoopAlignStrategy::Auto) all.emplace_back(loop, align);
  }
  return compute_with(level, all);
}
Stage& Stage::compute_with(const Stage& stage, const VarOrRVar& var,
                           const std::vector<std::pair<VarOrRVar, LoopAlignStrategy>>& align) {
  return compute_with(LoopLevel(Func(stage.function()), var, stage.index()), align);
}
Stage& Stage::compute_with(const Stage& stage, const VarOrRVar& var, LoopAlignStrategy align) {
  return compute_with(LoopLevel(Func(stage.function()), var, stage.index()), align);
}

Stage& Stage::prefetch(const Func& f, const VarOrRVar& at, const VarOrRVar& from, Expr offset,
                       PrefetchBoundStrategy strategy) {
  if (!f.defined()) {
    user_error(text("prefetch ", quoted(f.name()), " for ", quoted(name())),
               "it needs a definition first", "it has none", "Define it: f(x, y) = ...");
  }
  // Weak: what is prefetched may be any Func of the pipeline.
  return give(ir::PrefetchData{f.name(), at.name(), from.name(), std::move(offset), strategy,
                               ir::SymbolRef::weak(f.function()->shared_from_this())});
}
Stage& Stage::prefetch(const std::shared_ptr<ir::ParameterContents>& image, const VarOrRVar& at,
                       const VarOrRVar& from, Expr offset, PrefetchBoundStrategy strategy) {
  if (!image || !image->is_buffer) {
    user_error("prefetch for " + quoted(name()), "it is a Func or an image that is prefetched",
               image ? quoted(image->name) + " is a scalar" : std::string("it is undefined"),
               "Name a Func or an ImageParam");
  }
  return give(ir::PrefetchData{image->name, at.name(), from.name(), std::move(offset), strategy,
                               ir::SymbolRef(image)});
}

// ---- split and run ----

namespace {

VarOrRVar fresh_like(const VarOrRVar& var) {
  return var.is_rvar ? VarOrRVar(RVar()) : VarOrRVar(Var());
}

// What is asked for is refused before the loop is split.
void check_run(const ir::SchedulePlace& place, const VarOrRVar& var, ForType kind) {
  ir::Directive run = ir::RunLoop{var.name(), kind};
  ir::check_directive(place, run);
}

}  // namespace

Stage& Stage::parallel(const VarOrRVar& var, const Expr& task_size, TailStrategy tail) {
  check_run(place_, var, ForType::Parallel);
  return split(var, var, fresh_like(var), task_size, tail).parallel(var);
}

Stage& Stage::vectorize(const VarOrRVar& var, const Expr& factor, TailStrategy tail) {
  check_run(place_, var, ForType::Vectorized);
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
        text("tile ", as_list(previous), " of ", quoted(name())), "all lists have one length",
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
