#include "autoschedule/phase_loops.h"

#include <numeric>
#include <string>
#include <vector>

#include "analysis/periods.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// Vectors of sums that are kept in registers at once.
constexpr int64_t most_phases = 6;
// A tile has several sums for each phase.
constexpr int64_t most_phases_of_tile = 4;

}  // namespace

int64_t period_of_reads(const FuncContents& f, const Definition& stage, size_t dimension) {
  int64_t period = 1;
  for (const Expr& root : roots_with_inlined(stage)) {
    walk(root, [&](const Call& call) {
      if (call.call_type == CallType::Operator) return;
      for (const Expr& index : call.args) {
        const int64_t of_index = period_in(index, f.args[dimension]);
        period = period * of_index == 0 ? 0 : std::lcm(period, of_index);
      }
    });
  }
  return period == 0 || period > longest_period ? 1 : period;
}

std::optional<int64_t> growth_of_index(const Expr& index, const std::string& variable,
                                       int64_t period) {
  const auto moves = [&](const Expr& e) { return uses_variable(e, variable); };
  return growth_over(unclamped(without_lets(index), moves), variable, period);
}

int64_t phases_of_tile(const FuncContents& f, const Definition& stage, int lanes,
                       const SizeEstimate& sizes) {
  if (f.made || stage.rvars.empty()) return 1;
  const int64_t period = period_of_reads(f, stage, 0);
  if (period <= 1 || period > most_phases_of_tile) return 1;
  if (sizes.extent(f, 0).value_or(period * lanes) < period * lanes) return 1;
  bool is_dense = true;
  walk(stage, [&](const Call& call) {
    if (call.call_type == CallType::Operator || call.name == f.name) return;
    for (size_t d = 0; d < call.args.size(); ++d) {
      const auto growth = growth_of_index(call.args[d], f.args[0], period);
      is_dense &= growth == 0 || (d == 0 && growth == 1);
    }
  });
  return is_dense ? period : 1;
}

bool has_odd_phases(const FuncContents& f, const Definition& stage, int lanes) {
  const int64_t period = period_of_reads(f, stage, 0);
  return period <= most_phases && lanes % period != 0;
}

bool split_into_phases(const FuncContents& f, int index, Stage stage, int lanes,
                       const SizeEstimate& sizes) {
  const bool has_lanes = f.made && f.made->lanes > 0;  // of its own, in its first dimension
  if (has_lanes) return false;
  const int64_t period = period_of_reads(f, f.stage(index), 0);
  if (period <= 1 || period > most_phases) return false;
  if (f.stage(index).rvars.empty() && lanes % period == 0) return false;
  if (sizes.extent(f, 0).value_or(period * lanes) < period * lanes) return false;
  const Var x(f.args[0]), vector(inner_loop(f, index, f.args[0]));
  stage.split(x, x, vector, static_cast<int>(period) * lanes, TailStrategy::GuardWithIf);
  const Var phase(new_loop(f, index, "phase"));
  stage.split(vector, vector, phase, static_cast<int>(period), TailStrategy::GuardWithIf);
  std::vector<VarOrRVar> order{vector, phase};
  for (const Dim& loop : f.stage(index).schedule.dims) {
    if (loop.is_reduction) order.push_back(RVar(loop.var));
  }
  stage.reorder(order).vectorize(vector).unroll(phase);
  return true;
}

}  // namespace retrograde::autoschedule
