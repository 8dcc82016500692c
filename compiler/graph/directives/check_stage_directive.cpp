// check_stage_directive.cpp -- legality rules for directives of stages; each function lists its
// conditions as numbered checks.
#include <algorithm>
#include <optional>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/definitions/definition_rules.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/iteration_order.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde::graph {

namespace {

std::string loops_of(const StageLoops& schedule) {
  std::string out;
  for (auto dim = schedule.dims.rbegin(); dim != schedule.dims.rend(); ++dim) {
    out += (out.empty() ? "" : ", ") + quoted(dim->var);
  }
  return out.empty() ? "it has no loops" : "its loops are, outermost first, " + out;
}

// Tells what replaced a variable that is no longer a loop; empty when it never was one.
std::string replacement_of(const StageLoops& schedule, const std::string& var) {
  for (const Split& split : schedule.splits) {
    switch (split.kind) {
      case Split::Kind::Split:
        if (split.old_var != var) continue;
        return text(quoted(var), " was split into ", quoted(split.outer), " and ",
                    quoted(split.inner));
      case Split::Kind::Fuse:
        if (split.outer != var && split.inner != var) continue;
        return text(quoted(var), " was fused into ", quoted(split.old_var));
      case Split::Kind::Rename:
        if (split.old_var != var) continue;
        return text(quoted(var), " was renamed to ", quoted(split.outer));
    }
  }
  return "";
}

void check_factor(const Expr& factor, const std::string& asked) {
  if (!factor.defined())
    user_error(asked, "the factor must be a defined expression", "it was never assigned",
               "Assign every Expr before it is used");
  if (!factor.type().is_int_or_uint() || !factor.type().is_scalar()) {
    user_error(asked, "a factor is an integer",
               text(factor, " has type ", to_string(factor.type())), "Give an integer");
  }
  check_over_parameters(factor, "a factor", asked);
  auto constant = as_const_int(factor);
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

// Whether the points past the end of a loop belong to no other iteration. Past the end of an inner
// loop lie the points of the next iteration of the loop around it.
bool has_free_end(const StageLoops& schedule, std::string loop) {
  for (auto split = schedule.splits.rbegin(); split != schedule.splits.rend(); ++split) {
    if (split->kind == Split::Kind::Fuse) {
      if (split->old_var == loop) loop = split->outer;
    } else if (split->outer == loop) {
      loop = split->old_var;
    } else if (split->kind == Split::Kind::Split && split->inner == loop) {
      return false;
    }
  }
  return true;
}

// Whether the loop is an inner loop of constant extent that the factor divides, so that it has no
// tail.
bool divides_inner_loop(const StageLoops& schedule, const std::string& loop, const Expr& factor) {
  const auto small = as_const_int(factor);
  for (auto split = schedule.splits.rbegin(); split != schedule.splits.rend(); ++split) {
    if (split->kind == Split::Kind::Rename || split->inner != loop) continue;
    const auto large =
        split->kind == Split::Kind::Split ? as_const_int(split->factor) : std::optional<int64_t>();
    return small && large && *large % *small == 0;
  }
  return false;
}

void check_round_up(const StageLoops& schedule, const std::string& loop, const Expr& factor,
                    const std::string& asked) {
  if (has_free_end(schedule, loop) || divides_inner_loop(schedule, loop, factor)) return;
  user_error(asked, "an update definition does not run a point twice",
             text("TailStrategy::RoundUp runs ", quoted(loop),
                  " past its end, into the points of the next iteration around it"),
             "Use TailStrategy::GuardWithIf, or a factor that divides the loop's extent");
}

// A blending strategy stores past the end but writes back the old values; guarding those stores has
// the same effect.
TailStrategy without_blending(TailStrategy tail) {
  const bool blends =
      tail == TailStrategy::RoundUpAndBlend || tail == TailStrategy::ShiftInwardsAndBlend;
  return blends ? TailStrategy::PredicateStores : tail;
}

std::string level_text(const LoopLevel& level) {
  if (level.kind == LoopLevel::Kind::Root) return quoted("root");
  return level.kind == LoopLevel::Kind::At ? quoted(level.func + "." + level.var)
                                           : quoted("inlined");
}

// 1. The level is a loop. 2. It belongs to another Func, or to the stage before.
void check_fuse_level(const SchedulePlace& at, const LoopLevel& level) {
  const std::string asked =
      text("compute ", quoted(stage_name(*at.f, at.stage)), " with ", level_text(level));
  if (level.kind != LoopLevel::Kind::At) {
    user_error(asked, "a stage joins the loops of another one down to a loop",
               "the level is " + level_text(level), "Name a stage and one of its loops");
  }
  if (level.func == at.f->name && (at.stage == 0 || level.stage != at.stage - 1)) {
    user_error(asked, "within one Func, a stage joins the stage before it",
               text("the level is of ", level.stage < 0 ? std::string("no stage by name")
                                                        : quoted(stage_name(*at.f, level.stage))),
               at.stage == 0
                   ? std::string("Stages of one Func run in their order")
                   : text("Name the stage before: ", quoted(stage_name(*at.f, at.stage - 1))));
  }
}

std::string list_of(const std::vector<NamedLoop>& names) {
  return listed(names, [](const NamedLoop& name) { return quoted(name); });
}

void check_not_closed(const StageLoops& schedule, const std::string& asked) {
  if (schedule.specializations.empty() || schedule.specializations.back().failure.empty()) return;
  user_error(asked, "specialize_fail is the last of a stage's specializations",
             "specialize_fail was called already", "Specialize before specialize_fail");
}

// ---- one function per directive with rules: its conditions as numbered checks ----

template <typename D>
void check(D&, const SchedulePlace&) {}

// 1. The loop exists. 2. The new names differ and are new. 3. The factor is positive. 4. The tail
// fits the stage.
void check(SplitLoop& split, const SchedulePlace& at) {
  const std::string asked = text("split ", quoted(split.old), " of ", at.name(), " into ",
                                 quoted(split.outer), " and ", quoted(split.inner));
  const size_t old = loop_index(at, split.old, asked);
  if (split.outer == split.inner) {
    user_error(asked, "the two new loops have different names", "both are " + quoted(split.outer),
               "Use another Var");
  }
  check_new_loop(at, split.outer, split.old, asked);
  check_new_loop(at, split.inner, split.old, asked);
  check_factor(split.factor, asked);
  split.tail = without_blending(split.tail);
  check_tail(split.tail, at.stage > 0, at.schedule().dims[old].is_reduction, asked);
  if (at.stage > 0 && split.tail == TailStrategy::RoundUp)
    check_round_up(at.schedule(), split.old, split.factor, asked);
  split.factor = cast_to(Int(32), split.factor);
}

// 1. Both loops exist and differ. 2. The fused name is new. 3. Iterations that run concurrently
// access different elements. 4. The outer loop may move directly around the inner one.
void check(FuseLoops& fuse, const SchedulePlace& at) {
  const std::string asked =
      text("fuse ", quoted(fuse.inner), " and ", quoted(fuse.outer), " of ", at.name());
  const size_t inner = loop_index(at, fuse.inner, asked), outer = loop_index(at, fuse.outer, asked);
  if (inner == outer)
    user_error(asked, "it takes two loops", "both are " + quoted(fuse.inner), "Name two loops");
  if (fuse.fused != fuse.outer) check_new_loop(at, fuse.fused, fuse.inner, asked);
  check_fused_race(at, inner, outer, asked);
  if (outer == inner + 1) return;
  std::vector<Dim> dims = at.schedule().dims;
  const auto from = dims.begin() + static_cast<std::ptrdiff_t>(outer);
  const auto to = dims.begin() + static_cast<std::ptrdiff_t>(inner);
  outer < inner ? std::rotate(from, from + 1, to + 1) : std::rotate(to + 1, from, from + 1);
  check_reduction_order(at, dims, asked);
}

void check(RenameLoop& rename, const SchedulePlace& at) {
  const std::string asked =
      text("rename ", quoted(rename.old), " of ", at.name(), " to ", quoted(rename.renamed));
  loop_index(at, rename.old, asked);
  check_new_loop(at, rename.renamed, rename.old, asked);
}

// 1. Every loop exists. 2. No loop is named twice. 3. Reduction loops keep their order, unless the
// update commutes.
void check(ReorderLoops& reorder, const SchedulePlace& at) {
  const std::string asked = text("reorder ", list_of(reorder.loops), " of ", at.name());
  for (const std::string& loop : reorder.loops) loop_index(at, loop, asked);
  for (const std::string& loop : reorder.loops) {
    if (std::ranges::count(reorder.loops, loop) > 1)
      user_error(asked, "each loop is named once", quoted(loop) + " is named twice",
                 "Drop one of them");
  }
  StageLoops after;
  after.dims = at.schedule().dims;
  apply_directive(reorder, after);
  check_reduction_order(at, after.dims, asked);
}

void check(RunLoop& run, const SchedulePlace& at) {
  static constexpr const char* verbs[] = {
      "serialize ",         "parallelize ",        "vectorize ",       "unroll ",
      "run GPU blocks of ", "run GPU threads of ", "run GPU lanes of "};
  const std::string asked =
      text(verbs[static_cast<int>(run.kind)], at.name(), " over ", quoted(run.loop));
  if (run.loop != outermost_loop || run.kind != ForType::GpuBlock) loop_index(at, run.loop, asked);
  if (at.f->is_extern() && (is_gpu(run.kind) || run.kind == ForType::Vectorized)) {
    user_error(asked, "loops around the calls of a C function are serial, parallel or unrolled",
               quoted(at.f->name) + " is computed by a C function",
               "Let another Func read it, and schedule that one");
  }
  if (runs_at_once(run.kind) || run.kind == ForType::Vectorized)
    check_race_free(at, run.loop, run.kind, asked);
}

void check(PartitionLoop& partition, const SchedulePlace& at) {
  loop_index(at, partition.loop,
             text("choose how to partition the loop ", quoted(partition.loop), " of ", at.name()));
}

// 1. Both loops exist, and `at` is `from` or inside of it. 2. The offset is an integer that is
// known when a call begins.
void check(PrefetchData& prefetch, const SchedulePlace& at) {
  const std::string asked = text("prefetch ", quoted(prefetch.source), " for ", at.name(), " at ",
                                 quoted(prefetch.at), " from ", quoted(prefetch.from));
  const size_t inner = loop_index(at, prefetch.at, asked);
  const size_t outer = loop_index(at, prefetch.from, asked);
  if (inner > outer) {
    user_error(asked, "the prefetch happens at the loop it counts from, or inside that loop",
               text(quoted(prefetch.at), " is around ", quoted(prefetch.from)), "Swap them");
  }
  const Expr& offset = prefetch.offset;
  if (!offset.defined() || !offset.type().is_int_or_uint() || !offset.type().is_scalar()) {
    user_error(asked, "the offset is an integer",
               offset.defined() ? text(offset, " has type ", to_string(offset.type()))
                                : std::string("it is undefined"),
               "Give an integer");
  }
  check_over_parameters(offset, "the offset", asked);
  prefetch.offset = int32_literal(offset, asked);
}

// 1. The level is a loop. 2. It belongs to another Func or to the stage before; if its LoopLevel is
// not set yet, this is checked then. 3. This stage has no specializations and is not an extern
// stage. Whether the loops agree, and whether the stages are independent, is checked at compile
// time.
void check(ComputeWith& with, const SchedulePlace& at) {
  const bool is_known = !with.from || with.from->defined;
  if (is_known) check_fuse_level(at, with.level);
  const std::string asked =
      text("compute ", at.name(), " with ", is_known ? level_text(with.level) : "another stage");
  if (at.f->is_extern()) {
    user_error(asked, "the stage has loops", quoted(at.f->name) + " is computed by a C function",
               "Schedule another stage");
  }
  if (!at.schedule().specializations.empty() || !at.special.empty()) {
    user_error(asked, "a stage that joins the loops of another one has no specializations",
               text(at.name(), " has ", at.schedule().specializations.size()),
               "Specialize the other stage instead");
  }
}

// 1. The condition is a scalar bool. 2. It is over parameters. 3. No specialize_fail came before.
// 4. The stage is not fused with the loops of another.
void check(Specialize& specialize, const SchedulePlace& at) {
  const std::string asked = "specialize " + at.name();
  const Expr& condition = specialize.condition;
  if (!condition.defined())
    user_error(asked, "the condition is a defined expression", "it was never assigned",
               "Assign every Expr before it is used");
  if (!condition.type().is_bool() || !condition.type().is_scalar()) {
    user_error(asked, "the condition is of type bool",
               text(condition, " has type ", to_string(condition.type())),
               "Compare it with something");
  }
  check_over_parameters(condition, "the condition", asked);
  const StageLoops& now = at.schedule();
  if (specialization_for(now, condition) >= 0) return;
  check_not_closed(now, asked);
  if (now.fuse_level.kind != LoopLevel::Kind::At) return;
  user_error(asked, "a stage that joins the loops of another one has no specializations",
             text("compute_with put it into the loops of ", quoted(now.fuse_level.func)),
             "Specialize the other stage, or leave compute_with out");
}

void check(SpecializeFail& fail, const SchedulePlace& at) {
  const std::string asked = text("let ", at.name(), " fail when no specialization applies");
  const StringImm* message = fail.message.as<StringImm>();
  if (!message || message->value.empty()) {
    user_error(asked, "the message says something", "it is empty",
               "Say which inputs the pipeline is for");
  }
  check_not_closed(at.schedule(), asked);
}

}  // namespace

std::string SchedulePlace::name() const { return quoted(stage_name(*f, stage)); }

const StageLoops& SchedulePlace::schedule() const {
  const StageLoops* result = &definition().schedule;
  for (const int step : special) result = &result->specializations[static_cast<size_t>(step)];
  return *result;
}

int specialization_for(const StageLoops& schedule, const Expr& condition) {
  for (size_t i = 0; i < schedule.specializations.size(); ++i) {
    const Expr& earlier = schedule.specializations[i].condition;
    if (earlier.defined() && equal(earlier, condition)) return static_cast<int>(i);
  }
  return -1;
}

size_t loop_index(const SchedulePlace& place, const std::string& loop, const std::string& asked) {
  const StageLoops& now = place.schedule();
  for (size_t i = 0; i < now.dims.size(); i++) {
    if (now.dims[i].var == loop) return i;
  }
  const std::string fate = replacement_of(now, loop);
  user_error(asked, text(quoted(loop), " must be a loop of this stage"),
             fate.empty() ? loops_of(now) : fate + "; " + loops_of(now), "Name one of its loops");
}

void check_new_loop(const SchedulePlace& place, const std::string& name,
                    const std::string& replaced, const std::string& asked) {
  if (name == replaced) return;
  const StageLoops& now = place.schedule();
  const bool is_loop =
      std::ranges::any_of(now.dims, [&](const Dim& dim) { return dim.var == name; });
  if (!is_loop) return;
  user_error(asked, "the loops of a stage have different names",
             text(quoted(name), " is a loop already; ", loops_of(now)), "Use another Var");
}

void check_stage_directive(const SchedulePlace& place, Directive& directive) {
  std::visit([&](auto& d) { check(d, place); }, directive);
}

}  // namespace retrograde::graph
