#include "graph/directives/iteration_order.h"

#include <algorithm>
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

// The reduction variables all of whose loops are around loop `i` of `dims`: iterations that this loop runs
// agree in them. Those of updates of several points at once are not told apart.
std::unordered_set<std::string> variables_around(const Definition& definition,
                                                 const StageLoops& schedule,
                                                 const std::vector<Dim>& dims, size_t i) {
  std::unordered_set<std::string> around;
  if (point_number(definition)) return around;
  for (size_t outer = dims.size(); outer-- > i + 1;)
    around.merge(reduction_roots(definition, schedule, dims[outer].var));
  for (size_t inner = 0; inner <= i && inner < dims.size(); ++inner) {
    for (const std::string& root : reduction_roots(definition, schedule, dims[inner].var))
      around.erase(root);
  }
  return around;
}

// The reduction variable that makes the iterations of loop `i` of `dims` depend on each other; empty when none
// does.
std::string dependent_root(const FuncContents& f, const Definition& definition,
                           const StageLoops& schedule, const std::vector<Dim>& dims, size_t i) {
  const auto around = variables_around(definition, schedule, dims, i);
  for (const std::string& root : reduction_roots(definition, schedule, dims[i].var)) {
    if (!can_prove_race_free(f, definition, root, around)) return root;
  }
  return "";
}

// The loops whose iterations depend on each other, innermost first. Two orders of loops that have the same ones in
// the same order run all iterations that access one element in the same order: the outermost loop in which
// such a pair differs depends, in both orders, and thus is the same loop.
std::vector<std::string> dependent_loops(const FuncContents& f, const Definition& definition,
                                         const StageLoops& schedule, const std::vector<Dim>& dims) {
  std::vector<std::string> loops;
  for (size_t i = 0; i < dims.size(); ++i) {
    if (dims[i].is_reduction && !dependent_root(f, definition, schedule, dims, i).empty())
      loops.push_back(dims[i].var);
  }
  return loops;
}

std::vector<std::string> reduction_loops(const std::vector<Dim>& dims) {
  std::vector<std::string> loops;
  for (const Dim& dim : dims) {
    if (dim.is_reduction) loops.push_back(dim.var);
  }
  return loops;
}

// Whether the order of reduction loops keeps that of all iterations that access one element.
bool keeps_order_of_accesses(const FuncContents& f, const Definition& definition,
                             const StageLoops& schedule, const std::vector<Dim>& after) {
  return !point_number(definition) &&
         can_prove_same_order(f, definition, reduction_loops(schedule.dims), reduction_loops(after),
                              schedule.splits);
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

// A loop whose iterations run at the same time.
struct ConcurrentLoop {
  std::string name;
  bool is_vectorized = false;
  std::unordered_set<std::string> around;  // reduction variables in which these iterations agree
  bool is_in_kernel = false;
};

void check_concurrent(const SchedulePlace& at, const ConcurrentLoop& loop, const std::string& asked,
                      const std::string& otherwise = {}) {
  const Definition& stage = at.definition();
  const StageLoops& now = at.schedule();
  if (now.allow_races) return;
  for (const std::string& root : reduction_roots(stage, now, loop.name)) {
    if (can_prove_race_free(*at.f, stage, root, loop.around, loop.is_in_kernel)) continue;
    if (now.atomic) {
      if (now.override_associativity && loop.is_vectorized) continue;
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

std::string asked_where_concurrent(const std::string& asked, const Dim& loop) {
  return text(asked, ", where ", quoted(loop.var),
              loop.runs == ForType::Vectorized ? " is vectorized"
              : is_gpu(loop.runs)              ? " runs on a GPU"
                                               : " is parallel");
}

// Loops that run concurrently because of the loops around them still do so in the order `dims`. Threads of a kernel
// wait for nothing around them, so loops on a GPU are independent in any order.
void check_concurrent_loops(const SchedulePlace& at, const std::vector<Dim>& dims,
                            const std::string& asked) {
  for (size_t i = 0; i < dims.size(); ++i) {
    const Dim& loop = dims[i];
    if (!loop.is_reduction || !has_concurrent_iterations(loop) || is_gpu(loop.runs)) continue;
    check_concurrent(at,
                     {loop.var, loop.runs == ForType::Vectorized,
                      variables_around(at.definition(), at.schedule(), dims, i)},
                     asked_where_concurrent(asked, loop),
                     text("Keep ", quoted(loop.var), " where it is"));
  }
}

}  // namespace

void check_reduction_order(const SchedulePlace& at, const std::vector<Dim>& dims,
                           const std::string& asked) {
  const FuncContents& f = *at.f;
  const Definition& definition = at.definition();
  const StageLoops& now = at.schedule();
  if (reduction_loops(now.dims) == reduction_loops(dims)) return;
  check_concurrent_loops(at, dims, asked);
  if (stores_one_value(f, definition) || can_prove_commutative(f, definition)) return;
  const std::vector<std::string> before = dependent_loops(f, definition, now, now.dims);
  const std::vector<std::string> after = dependent_loops(f, definition, now, dims);
  if (before == after || keeps_order_of_accesses(f, definition, now, dims)) return;
  size_t i = 0;
  while (i < before.size() && i < after.size() && before[i] == after[i]) i++;
  const bool in_new = i < after.size();
  const std::vector<Dim>& loops = in_new ? dims : now.dims;
  const auto loop = std::ranges::find(loops, (in_new ? after : before)[i], &Dim::var);
  const std::string root =
      dependent_root(f, definition, now, loops, static_cast<size_t>(loop - loops.begin()));
  user_error(asked, "the order of reduction loops may change only where it changes no result",
             text("the update of ", quoted(f.name), " over ", quoted(root),
                  " is neither an accumulation nor independent from point to point"),
             "Keep the reduction loops in their order; pure loops may go anywhere");
}

void check_race_free(const SchedulePlace& at, const std::string& loop, ForType runs,
                     const std::string& asked) {
  const std::vector<Dim>& dims = at.schedule().dims;
  ConcurrentLoop concurrent{loop, runs == ForType::Vectorized, {}, is_gpu(runs)};
  const auto found = std::ranges::find(dims, loop, &Dim::var);
  if (found != dims.end() && !is_gpu(runs)) {
    concurrent.around = variables_around(at.definition(), at.schedule(), dims,
                                         static_cast<size_t>(found - dims.begin()));
  }
  check_concurrent(at, concurrent, asked);
}

void check_fused_race(const SchedulePlace& at, size_t inner, size_t outer,
                      const std::string& asked) {
  const std::vector<Dim>& dims = at.schedule().dims;
  for (const size_t i : {inner, outer}) {
    const Dim& concurrent = dims[i];
    if (!has_concurrent_iterations(concurrent)) continue;
    ConcurrentLoop fused{"", concurrent.runs == ForType::Vectorized, {}, is_gpu(concurrent.runs)};
    if (outer == inner + 1 && !is_gpu(concurrent.runs))
      fused.around = variables_around(at.definition(), at.schedule(), dims, outer);
    for (const size_t part : {inner, outer}) {
      fused.name = dims[part].var;
      check_concurrent(
          at, fused, asked_where_concurrent(asked, concurrent),
          text("Keep ", quoted(dims[inner].var), " and ", quoted(dims[outer].var), " apart"));
    }
  }
}

}  // namespace retrograde::graph
