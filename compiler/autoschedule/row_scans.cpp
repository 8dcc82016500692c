#include "autoschedule/row_scans.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "analysis/linear.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// Rows that hide the latency of a multiplication and an addition, and fill a vector of functions.
constexpr int64_t most_rows = 8, least_rows = 4;
// Operations of an element from which a vector saves more than loads and stores with a stride cost, and from which the
// operations of more rows weigh more than their places in a cache.
constexpr double vectors_pay = 6, rows_pay = 16;

size_t innermost_in_memory(const FuncContents& f) {
  const auto& order = f.schedule.storage_dims;
  if (order.empty()) return 0;
  return static_cast<size_t>(std::ranges::find(f.args, order.front()) - f.args.begin());
}

bool uses_some(const Expr& e, const std::vector<ReductionVariable>& rvars) {
  return std::ranges::any_of(rvars,
                             [&](const ReductionVariable& r) { return uses_variable(e, r.var); });
}

// Funcs and images whose rows are read as the update runs along its own, which is one of them.
int64_t rows_read(const FuncContents& f, const Definition& update) {
  std::unordered_set<std::string> read{f.name};
  for (const Expr& root : roots_with_inlined(update)) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool is_read = call && call->call_type != CallType::Operator &&
                           std::ranges::any_of(call->args, [&](const Expr& arg) {
                             return uses_some(arg, update.rvars);
                           });
      if (is_read) read.insert(call->name);
      return true;
    });
  }
  return static_cast<int64_t>(read.size());
}

// The dimension of the rows that run at once: the first that is known to be long enough, or of unknown size.
std::optional<size_t> dimension_of_rows(const FuncContents& f, const Definition& update,
                                        const SizeEstimate& sizes) {
  std::optional<size_t> best;
  int64_t most = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const int64_t extent = std::min(sizes.extent(f, d).value_or(most_rows), most_rows);
    if (extent <= most || !is_pure_position(f, update, d)) continue;
    most = extent;
    best = d;
  }
  return best;
}

// Fewer rows at once where there would be few tasks.
int64_t rows_of_task(int64_t extent, int64_t most, int64_t other_tasks) {
  while (most > least_rows && (extent + most - 1) / most * other_tasks < planning::reference_tasks)
    most /= 2;
  return std::min(extent, most);
}

}  // namespace

bool runs_along_row(const FuncContents& f, const Definition& update) {
  const size_t row = innermost_in_memory(f);
  return !update.rvars.empty() && row < update.args.size() && !point_number(update) &&
         uses_some(update.args[row], update.rvars) &&
         decompose(update.args[row], mapped(update.rvars, &ReductionVariable::var)) &&
         read_elsewhere(f, update).defined();
}

RowChains chains_of(const FuncContents& f, const Definition& update, std::optional<int64_t> extent,
                    int64_t other_tasks) {
  const double operations = operations_of_values(update.values, [](const Call&) { return 0.0; });
  // Rows whose distance is a power of two share a few lines of the nearest cache: eight of them in all.
  const int64_t streams = rows_read(f, update);
  const int64_t most = operations >= rows_pay || streams == 1 ? most_rows : least_rows;
  const int64_t rows = extent ? rows_of_task(*extent, most, other_tasks) : most;
  return {0, static_cast<int>(rows), operations >= vectors_pay || streams > 1};
}

std::optional<RowChains> row_chains(const FuncContents& f, const Definition& update,
                                    const SizeEstimate& sizes) {
  if (!runs_along_row(f, update)) return std::nullopt;
  const auto dimension = dimension_of_rows(f, update, sizes);
  if (!dimension) return std::nullopt;
  int64_t other_tasks = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (d != *dimension && is_pure_position(f, update, d))
      other_tasks *= std::min(sizes.extent(f, d).value_or(planning::reference_tasks),
                              planning::reference_tasks);
  }
  RowChains result = chains_of(f, update, sizes.extent(f, *dimension), other_tasks);
  result.dimension = *dimension;
  return result;
}

bool schedule_row_scan(const FuncPtr& f, int index, const SizeEstimate& sizes) {
  const Definition& update = f->stage(index);
  const auto chains = row_chains(*f, update, sizes);
  if (!chains || !update.schedule.splits.empty()) return false;
  Stage stage(f, index);
  const Var rows(f->args[chains->dimension]), row(inner_loop(*f, index, rows.name()));
  stage.split(rows, rows, row, chains->rows, TailStrategy::GuardWithIf);
  std::vector<VarOrRVar> order{row};
  for (const ReductionVariable& r : update.rvars) order.emplace_back(RVar(r.var));
  for (size_t d = 0; d < f->args.size(); ++d) {
    if (is_pure_position(*f, update, d)) order.emplace_back(Var(f->args[d]));
  }
  stage.reorder(order);
  chains->in_vectors ? stage.vectorize(row) : stage.unroll(row);
  return true;
}

}  // namespace retrograde::autoschedule
