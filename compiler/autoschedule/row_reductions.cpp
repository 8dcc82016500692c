#include "autoschedule/row_reductions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "analysis/linear.h"
#include "autoschedule/access/plain_reduction.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/long_sums.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/loop_level.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr double of_an_end = 16;    // cycles that combine the lanes of a partial result
constexpr double of_a_tuple = 5;    // cycles that combine one lane with the others
constexpr double worth_rows = 0.7;  // of the cycles of vectors of elements
constexpr double as_good = 1.05;    // of the cycles: fewer lanes are preferred
constexpr double unknown_extent = 1024;
constexpr int most_vectors = 4;  // of a row

double extent_of(const ReductionVariable& r) {
  const auto extent = as_const_int(simplify(r.extent));
  return extent ? static_cast<double>(*extent) : unknown_extent;
}

// Whether each element is a reduction by itself.
bool stays_in_place(const FuncContents& f, const Definition& update) {
  const auto moves = [&](const Expr& e) {
    return std::ranges::any_of(update.rvars,
                               [&](const ReductionVariable& r) { return uses_variable(e, r.var); });
  };
  return !update.rvars.empty() && !point_number(update) &&
         std::ranges::none_of(update.args, moves) &&
         !(update.predicate.defined() && calls(update.predicate, &f));
}

// Whether the values of a Tuple may be combined in any order, as an extreme with its place are.
bool is_reduction_of_tuples(const FuncContents& f, const Definition& update) {
  if (update.values.size() < 2 || f.args.empty()) return false;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, update, d)) return false;
  }
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

// The loads that a vector of so many lanes along a variable takes; `whole`: where the lanes lie next to each other.
double loads_of(const Call& call, const std::string& var, double lanes, double whole) {
  const auto moves = [&](const Expr& e) { return uses_variable(e, var); };
  const size_t row = innermost_dimension(call);
  for (size_t d = 0; d < call.args.size(); ++d) {
    if (d != row && moves(call.args[d])) return planning::core.gather_lane_operations * lanes;
  }
  if (call.args.empty() || !moves(call.args[row])) return 1;
  const auto form = analysis::decompose(unclamped(call.args[row], moves), {var});
  if (!form) return planning::core.gather_lane_operations * lanes;
  const auto step = static_cast<double>(std::abs(form->coefficients[0].second));
  return std::min(planning::core.gather_lane_operations * lanes, whole * std::max(step, 1.0));
}

// What an iteration of an update takes, with what is inlined into it.
class Iteration {
 public:
  Iteration(const FuncContents& f, const Definition& update) : roots_(roots_with_inlined(update)) {
    for (Expr& root : roots_) {
      root = without_lets(root);
      walk(root, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        const bool reads = call && call->call_type != CallType::Operator && call->name != f.name;
        if (reads && is_moved(*call, update)) reads_.push_back(call);
        return true;
      });
    }
    operations_ = operations_of_values(roots_, [](const Call&) { return 0.0; });
  }

  // Cycles of a vector along the variable, or of one term where it is empty. `registers`: of such a vector.
  double cycles(const std::string& var, double lanes, double registers) const {
    double loads = 0, inserts = 0;
    for (const Call* read : reads_) {
      const double of_read = var.empty() ? 1 : loads_of(*read, var, lanes, registers);
      loads += of_read;
      if (!var.empty() && of_read >= planning::core.gather_lane_operations * lanes)
        inserts += of_read;
    }
    return std::max(loads, registers * operations_ + inserts) / planning::core.loads_per_cycle;
  }

 private:
  // What no loop of the reduction moves is loaded before them.
  static bool is_moved(const Call& call, const Definition& update) {
    return std::ranges::any_of(update.rvars, [&](const ReductionVariable& r) {
      return std::ranges::any_of(call.args,
                                 [&](const Expr& arg) { return uses_variable(arg, r.var); });
    });
  }

  std::vector<Expr> roots_;
  std::vector<const Call*> reads_;
  double operations_ = 0;
};

// Cycles of one element of the result.
class RowCosts {
 public:
  RowCosts(const FuncContents& f, const Definition& update, int lanes,
           const planning::Machine& machine, const SizeEstimate& sizes)
      : f_(f), update_(update), iteration_(f, update), lanes_(lanes), sizes_(sizes) {
    const double bytes = static_cast<double>(lanes) * bits_of_values(update.values) / 8.0;
    registers_ = std::max(1.0, bytes / static_cast<double>(machine.vector_bytes));
    for (const ReductionVariable& r : update.rvars) terms_ *= extent_of(r);
  }

  double of_elements() const {
    if (f_.args.empty() || !is_pure_position(f_, update_, 0))
      return terms_ * std::max(planning::core.float_latency, iteration_.cycles("", 1, 1));
    const double a_vector =
        std::max(planning::core.float_latency, iteration_.cycles(f_.args[0], lanes_, registers_));
    const double extent = static_cast<double>(sizes_.extent(f_, 0).value_or(lanes_));
    return terms_ * a_vector / std::clamp<double>(extent, 1, lanes_);
  }

  double of_row(const ReductionVariable& r, int lanes, bool is_tuple) const {
    const double extent = std::max(extent_of(r), 1.0), registers = registers_ * lanes / lanes_;
    const double a_vector =
        std::max(planning::core.float_latency, iteration_.cycles(r.var, lanes, registers));
    const double end = is_tuple ? of_a_tuple * lanes : of_an_end + registers;
    return terms_ / extent * std::ceil(extent / lanes) * a_vector + end;
  }

  // Lanes of one register.
  int least_lanes() const { return std::max(static_cast<int>(lanes_ / registers_), 1); }

 private:
  const FuncContents& f_;
  const Definition& update_;
  const Iteration iteration_;
  const double lanes_;
  const SizeEstimate& sizes_;
  double registers_ = 1;  // of a vector of elements
  double terms_ = 1;
};

// Of the result; unknown extents count as long.
double elements_of(const FuncContents& f, const Definition& update, const SizeEstimate& sizes) {
  double elements = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto extent = sizes.extent(f, d);
    if (!is_pure_position(f, update, d)) continue;
    elements *= extent ? static_cast<double>(*extent) : unknown_extent;
  }
  return elements;
}

// The values of each lane of a Tuple, in registers, and then those of all of them.
void factor_lanes(const FuncPtr& f, int index, const RVar& lane, int lanes) {
  const Var u(new_loop(*f, index, "lanes"));
  Func parts = Stage(f, index).rfactor(lane, u);
  parts.compute_at(retrograde::LoopLevel(Func(f), Var(f->args[0]), index));
  parts.vectorize(u, lanes);
  parts.update().vectorize(u, lanes);
  Stage(f, index).unroll(lane);
}

}  // namespace

std::optional<RowReduction> row_reduction(const FuncContents& f, const Definition& update,
                                          int lanes, const planning::Machine& machine,
                                          const SizeEstimate& sizes) {
  if (!stays_in_place(f, update)) return std::nullopt;
  const bool is_tuple = update.values.size() > 1;
  const RowCosts costs(f, update, lanes, machine, sizes);
  const double elements = elements_of(f, update, sizes);
  std::optional<RowReduction> best;
  double least = costs.of_elements() * worth_rows * as_good;
  for (const ReductionVariable& r : update.rvars) {
    for (int n = costs.least_lanes(); n <= most_vectors * lanes && n <= extent_of(r); n *= 2) {
      const double cycles = costs.of_row(r, n, is_tuple);
      if (cycles * as_good >= least) continue;
      least = cycles;
      best = RowReduction{r.var, n, cycles * elements < planning::launch_cycles};
    }
  }
  const bool is_legal = best && (is_tuple ? is_reduction_of_tuples(f, update)
                                          : planning::is_plain_reduction(f, update));
  return is_legal ? best : std::nullopt;
}

void reduce_along_rows(const FuncPtr& f, int index, const RowReduction& row) {
  std::vector<ReductionVariable> loops = reduction_loops(*f, f->stage(index));
  std::ranges::stable_partition(loops,
                                [&](const ReductionVariable& r) { return r.var == row.loop; });
  const RVar all(row.loop), lane(inner_loop(*f, index, row.loop));
  Stage stage(f, index);
  stage.split(all, all, lane, row.lanes, TailStrategy::GuardWithIf);
  std::vector<VarOrRVar> order{lane};
  for (const ReductionVariable& r : loops) order.emplace_back(RVar(r.var));
  for (size_t d = 0; d < f->args.size(); ++d) {
    if (is_pure_position(*f, f->stage(index), d)) order.emplace_back(Var(f->args[d]));
  }
  stage.reorder(order);
  if (f->types.size() > 1) return factor_lanes(f, index, lane, row.lanes);
  stage.allow_race_conditions().vectorize(lane);
  if (is_long_sum(*f, f->stage(index), loops, row.lanes)) add_in_blocks(f, index, loops, row.lanes);
}

}  // namespace retrograde::autoschedule
