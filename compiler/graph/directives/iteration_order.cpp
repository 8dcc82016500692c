#include "graph/directives/iteration_order.h"

#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/race_checks.h"
#include "ir/print.h"

namespace retrograde::graph {

namespace {

// The reduction variables that a loop derives from.
std::unordered_set<std::string> reduction_roots(const Definition& definition,
                                                const StageLoops& schedule,
                                                const std::string& loop) {
  std::unordered_set<std::string> names{loop};
  const auto& splits = schedule.splits;
  for (auto split = splits.rbegin(); split != splits.rend(); ++split) {
    if (split->kind == Split::Kind::Fuse) {
      if (names.erase(split->old_var)) names.insert({split->outer, split->inner});
    } else if (names.erase(split->outer) + names.erase(split->inner) > 0) {
      names.insert(split->old_var);
    }
  }
  std::unordered_set<std::string> roots;
  for (const ReductionVariable& rvar : definition.rvars) {
    if (names.count(rvar.var)) roots.insert(rvar.var);
  }
  return roots;
}

// The reduction variable that makes a loop's iterations depend on each other; empty when none does.
std::string dependent_root(const FuncContents& f, const Definition& definition,
                           const StageLoops& schedule, const std::string& loop) {
  for (const std::string& root : reduction_roots(definition, schedule, loop)) {
    if (!can_prove_race_free(f, definition, root)) return root;
  }
  return "";
}

// An atomic update protects only the element that it writes; other iterations may write the others
// at any time. An update of several points takes one lock for all of them.
void check_atomic_reads(const FuncContents& f, const Definition& update, const std::string& asked) {
  if (point_number(update)) return;
  const Expr other = read_of_other_element(f, update);
  if (!other.defined()) return;
  user_error(asked, "an atomic update reads no element of its Func but the one that it writes",
             text("it reads ", other, ", which another iteration may write"),
             "Keep the loop serial, or compute what is read in another Func");
}

bool has_concurrent_iterations(const Dim& loop) {
  return runs_at_once(loop.runs) || loop.runs == ForType::Vectorized;
}

}  // namespace

void check_reduction_order(const SchedulePlace& at, const std::vector<Dim>& dims,
                           const std::string& asked) {
  const FuncContents& f = *at.f;
  const Definition& definition = at.definition();
  const StageLoops& now = at.schedule();
  const auto dependent_loops = [&](const std::vector<Dim>& all) {
    std::vector<std::string> order;
    for (const Dim& dim : all) {
      if (dim.is_reduction && !dependent_root(f, definition, now, dim.var).empty())
        order.push_back(dim.var);
    }
    return order;
  };
  const std::vector<std::string> before = dependent_loops(now.dims), after = dependent_loops(dims);
  if (before == after || stores_one_value(f, definition) || can_prove_commutative(f, definition))
    return;
  size_t i = 0;
  while (before[i] == after[i]) i++;
  user_error(asked, "the order of reduction loops may change only where it changes no result",
             text("the update of ", quoted(f.name), " over ",
                  quoted(dependent_root(f, definition, now, after[i])),
                  " is neither an accumulation nor independent from point to point"),
             "Keep the reduction loops in their order; pure loops may go anywhere");
}

void check_race_free(const SchedulePlace& at, const std::string& loop, bool is_vectorized,
                     const std::string& asked, const std::string& otherwise) {
  const Definition& stage = at.definition();
  const StageLoops& now = at.schedule();
  if (now.allow_races) return;
  for (const std::string& root : reduction_roots(stage, now, loop)) {
    if (can_prove_race_free(*at.f, stage, root)) continue;
    if (now.atomic) {
      if (now.override_associativity && is_vectorized) continue;
      if (stores_one_value(*at.f, stage)) continue;
      check_atomic_reads(*at.f, stage, asked);
      if (now.override_associativity) continue;
      const AssociativityProof update = prove_associative(*at.f, stage);
      if (update.op && update.op->commutative) return;
      user_error(asked, "an atomic update is associative and commutative",
                 update.op ? update.why_not_commutative : update.why_not,
                 "Give atomic(true) if its order does not matter, or keep the loop serial");
    }
    std::string pure;
    for (const Dim& dim : now.dims) {
      if (!dim.is_reduction) pure += (pure.empty() ? "" : " or ") + quoted(dim.var);
    }
    user_error(
        asked, "iterations that run at the same time must not touch the same element",
        text(quoted(root),
             " is a reduction variable, and its iterations may read or write one element of ",
             quoted(at.f->name)),
        text(!otherwise.empty() ? otherwise
             : pure.empty()     ? "Reduce into more elements first, with rfactor"
                                : "Use " + pure + " instead: its iterations are independent",
             "; or make the update atomic(), or allow_race_conditions()"));
  }
}

void check_fused_race(const SchedulePlace& at, const Dim& inner, const Dim& outer,
                      const std::string& asked) {
  for (const Dim* concurrent : {&inner, &outer}) {
    if (!has_concurrent_iterations(*concurrent)) continue;
    const std::string asked_with_reason =
        text(asked, ", where ", quoted(concurrent->var),
             concurrent->runs == ForType::Vectorized ? " is vectorized"
             : is_gpu(concurrent->runs)              ? " runs on a GPU"
                                                     : " is parallel");
    for (const Dim* loop : {&inner, &outer})
      check_race_free(at, loop->var, concurrent->runs == ForType::Vectorized, asked_with_reason,
                      text("Keep ", quoted(inner.var), " and ", quoted(outer.var), " apart"));
  }
}

}  // namespace retrograde::graph
