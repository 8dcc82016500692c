#include "autoschedule/step_loops.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <unordered_set>

#include "analysis/linear.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/row_scans.h"
#include "autoschedule/wavefronts.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/race_checks.h"
#include "ir/build.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

using Names = std::vector<std::string>;

constexpr size_t most_variables = 5;
constexpr size_t most_clamps = 5;  // of an access: with more, proofs take long and seldom succeed
constexpr int64_t least_row = 4;
constexpr int chunk_of_row = 2048;  // elements that are a task, if a step is a single row

Names joined(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::optional<int64_t> extent_of(const Definition& update, const std::string& variable) {
  const auto found = std::ranges::find(update.rvars, variable, &ReductionVariable::var);
  return as_const_int(simplify(found->extent));
}

bool is_along_row(const FuncContents& f, const Definition& update, const std::string& variable) {
  if (extent_of(update, variable).value_or(least_row) < least_row) return false;
  const auto moves = [&](const Expr& place) { return uses_variable(place, variable); };
  if (std::ranges::count_if(update.args, moves) != 1) return false;
  const auto& order = f.schedule.storage_dims;
  const auto innermost = order.empty() ? f.args.begin() : std::ranges::find(f.args, order.front());
  const auto row = static_cast<size_t>(innermost - f.args.begin());
  const auto form = decompose(update.args[row], {variable});
  return form && form->coefficients.size() == 1 && std::abs(form->coefficients[0].second) == 1;
}

// ---- which variables are steps ----

class StepFinder {
 public:
  StepFinder(const FuncContents& f, const Definition& update)
      : f_(f), update_(update), variables_(mapped(update.rvars, &ReductionVariable::var)) {}

  // As few steps as possible, the outermost variables first; more only for the sake of vectors.
  StepVariables find() {
    const size_t count = variables_.size();
    if (count == 0 || count > most_variables || point_number(update_) ||
        clamps_of_an_access() > most_clamps)
      return {};
    for (const std::string& variable : variables_)
      is_apart_.push_back(graph::can_prove_race_free(f_, update_, variable));
    StepVariables best;
    for (int steps = 0; steps < static_cast<int>(count); ++steps) {
      for (unsigned bits = 1u << count; bits-- > 0;) {
        if (std::popcount(bits) != steps || has_apart(bits)) continue;
        StepVariables other = with_steps(bits);
        const bool is_no_better =
            other.along_row.empty() && (best.any_independent() || !other.any_independent());
        if (is_no_better) continue;
        if (graph::can_prove_same_order(f_, update_, variables_, other.order()))
          best = std::move(other);
        if (!best.along_row.empty()) return best;
      }
    }
    return best;
  }

 private:
  // The average number of minima and maxima in the coordinates of an access. A proof looks at the cases of each.
  size_t clamps_of_an_access() const {
    size_t clamps = 0;
    const auto count = [&](const std::vector<Expr>& coordinates) {
      for (const Expr& e : coordinates) {
        walk(e, [&](const Expr& part) {
          clamps += part.kind() == Kind::Min || part.kind() == Kind::Max;
          return true;
        });
      }
    };
    const std::vector<Expr> reads = graph::own_reads(f_, update_);
    count(update_.args);
    for (const Expr& read : reads) count(read.as<Call>()->args);
    return clamps / (reads.size() + 1);
  }

  bool has_apart(unsigned bits) const {
    for (size_t i = 0; i < is_apart_.size(); ++i) {
      if ((bits >> i & 1u) && is_apart_[i]) return true;
    }
    return false;
  }

  // The variables of the subset `bits` are steps.
  StepVariables with_steps(unsigned bits) const {
    StepVariables result;
    std::unordered_set<std::string> around;
    Names others;
    for (size_t i = 0; i < variables_.size(); ++i) {
      const bool is_step = bits >> i & 1u;
      (is_apart_[i] ? result.apart : is_step ? result.steps : others).push_back(variables_[i]);
      if (is_apart_[i] || is_step) around.insert(variables_[i]);
    }
    for (const std::string& variable : others) {
      const bool is_point = bits != 0 && graph::can_prove_race_free(f_, update_, variable, around);
      (is_point ? result.points : result.inside).push_back(variable);
    }
    for (Names* names : {&result.apart, &result.points}) {
      if (result.along_row.empty()) result.along_row = row_moved_first(*names);
    }
    return result;
  }

  std::string row_moved_first(Names& names) const {
    const auto found = std::ranges::find_if(
        names, [&](const std::string& name) { return is_along_row(f_, update_, name); });
    if (found == names.end()) return "";
    std::rotate(names.begin(), found, found + 1);
    return names.front();
  }

  const FuncContents& f_;
  const Definition& update_;
  const Names variables_;
  std::vector<bool> is_apart_;
};

// ---- their loops ----

class StepScheduler {
 public:
  StepScheduler(const FuncPtr& f, int stage, StepVariables variables, const SizeEstimate& sizes)
      : f_(*f),
        index_(stage),
        stage_(f, stage),
        variables_(std::move(variables)),
        sizes_(sizes),
        all_have_work_(have_enough_work(variables_.order())),
        step_has_work_(have_enough_work(joined(variables_.inside, variables_.points))) {}

  void give(int most_lanes) {
    reorder(variables_.order());
    run_pure_loops_in_parallel();
    if (!row().empty())
      vectorize_row(most_lanes);
    else if (!run_front())
      run_several_rows();
    if (all_have_work_) run_in_parallel(variables_.apart);
    if (step_has_work_) run_in_parallel(variables_.points);
  }

 private:
  const Definition& update() const { return f_.stage(index_); }
  const std::string& row() const { return variables_.along_row; }
  bool wants_tasks() const { return tasks_ < sizes_.machine().enough_tasks(); }

  void reorder(const Names& loops) {
    std::vector<VarOrRVar> order;
    for (const std::string& loop : loops) order.push_back(RVar(loop));
    if (order.size() > 1) stage_.reorder(order);
  }

  bool have_enough_work(const Names& loops) const {
    double operations = operations_of_values(update().values, [](const Call&) { return 1.0; });
    for (const std::string& loop : loops) {
      const auto extent = extent_of(update(), loop);
      operations *= extent ? static_cast<double>(*extent) : planning::launch_operations;
    }
    return operations >= planning::launch_operations;
  }

  // The outermost, until these are enough tasks.
  void run_pure_loops_in_parallel() {
    const std::vector<Dim> loops = update().schedule.dims;
    for (auto loop = loops.rbegin(); loop != loops.rend() && wants_tasks(); ++loop) {
      if (loop->is_reduction) continue;
      const auto arg = std::ranges::find(f_.args, loop->var);
      const auto extent = sizes_.extent(f_, static_cast<size_t>(arg - f_.args.begin()));
      stage_.parallel(Var(loop->var));
      tasks_ *= extent.value_or(sizes_.machine().enough_tasks());
    }
  }

  // A row that would be a single task is split into chunks.
  bool is_split_into_chunks() const {
    const bool is_apart = std::ranges::count(variables_.apart, row()) > 0;
    return variables_.points.size() + variables_.apart.size() == 1 && wants_tasks() &&
           (is_apart ? all_have_work_ : step_has_work_) &&
           extent_of(update(), row()).value_or(2 * chunk_of_row) >= 2 * chunk_of_row;
  }

  // Vectors inside of all other loops, chunks inside of the loops over steps.
  void vectorize_row(int lanes) {
    while (lanes > extent_of(update(), row()).value_or(lanes)) lanes /= 2;
    const std::string vector = inner_loop(f_, index_, row());
    std::string whole = row();
    Names loops;
    if (is_split_into_chunks()) {
      const std::string chunk = new_loop(f_, index_, "chunk");
      stage_.split(RVar(whole), RVar(whole), RVar(chunk), chunk_of_row, TailStrategy::GuardWithIf);
      whole = chunk;
      loops.push_back(chunk);
    }
    stage_.split(RVar(whole), RVar(whole), RVar(vector), lanes, TailStrategy::GuardWithIf);
    reorder(joined(joined({vector}, variables_.inside), loops));
    stage_.vectorize(RVar(vector));
    if (loops.empty()) return;
    stage_.parallel(RVar(row()));
    tasks_ = sizes_.machine().enough_tasks();
  }

  // Scans along rows that a reduction variable numbers: several rows at once (row_scans.h).
  void run_several_rows() {
    const bool is_scan = !variables_.apart.empty() && variables_.points.empty() &&
                         variables_.steps.empty() && runs_along_row(f_, update());
    if (!is_scan) return;
    const std::string all = variables_.apart.front();
    const RowChains chains = chains_of(f_, update(), extent_of(update(), all), 1);
    if (chains.rows < 2) return;
    const RVar row(inner_loop(f_, index_, all));
    stage_.split(RVar(all), RVar(all), row, chains.rows, TailStrategy::GuardWithIf);
    reorder(joined({row.name()}, variables_.inside));
    chains.in_vectors ? stage_.vectorize(row) : stage_.unroll(row);
  }

  // Whether the innermost points lie on a diagonal, so that they run in vectors with a stride, or unrolled
  // (wavefronts.h).
  bool run_front() {
    const Names loops = variables_.order();
    const std::string all = loops.front();
    const auto is_diagonal = [&](const Expr& place) {
      return std::any_of(loops.begin() + 1, loops.end(), [&](const std::string& other) {
        const auto form = decompose(without_promises(place), {all, other});
        return form && form->coefficients.size() == 2;
      });
    };
    if (std::ranges::none_of(update().args, is_diagonal) ||
        !graph::can_prove_race_free(f_, update(), all, {loops.begin() + 1, loops.end()}))
      return false;
    const FrontLanes lanes = front_lanes(update());
    RVar point(all);
    if (extent_of(update(), all) != lanes.rows) {
      point = RVar(inner_loop(f_, index_, all));
      stage_.split(RVar(all), RVar(all), point, lanes.rows, TailStrategy::GuardWithIf);
    }
    lanes.in_vectors ? stage_.vectorize(point) : stage_.unroll(point);
    return true;
  }

  void run_in_parallel(const Names& loops) {
    for (auto loop = loops.rbegin(); loop != loops.rend() && wants_tasks(); ++loop) {
      if (*loop == row()) continue;
      stage_.parallel(RVar(*loop));
      tasks_ *= extent_of(update(), *loop).value_or(sizes_.machine().enough_tasks());
    }
  }

  const FuncContents& f_;
  const int index_;
  Stage stage_;
  const StepVariables variables_;
  const SizeEstimate& sizes_;
  const bool all_have_work_, step_has_work_;
  int64_t tasks_ = 1;  // that run in parallel
};

}  // namespace

Names StepVariables::order() const { return joined(joined(inside, points), joined(steps, apart)); }

StepVariables step_variables(const FuncContents& f, const Definition& update) {
  return StepFinder(f, update).find();
}

bool schedule_steps(const FuncPtr& f, int stage, int lanes, const SizeEstimate& sizes) {
  const Definition& update = f->stage(stage);
  const auto& loops = update.schedule;
  const bool is_part = f->made && (f->made->lanes > 0 || f->made->has_parts || f->made->blocks > 0);
  const bool is_touched =
      std::ranges::any_of(loops.dims, [](const Dim& loop) { return loop.runs != ForType::Serial; });
  if (is_part || is_touched || !loops.splits.empty()) return false;
  StepVariables variables = step_variables(*f, update);
  if (!variables.any_independent()) return false;
  StepScheduler(f, stage, std::move(variables), sizes).give(lanes);
  return true;
}

}  // namespace retrograde::autoschedule
