#include "autoschedule/short_rows.h"

#include <algorithm>
#include <optional>
#include <unordered_set>
#include <vector>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "graph/definitions/own_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// The first dimension beyond the rows that fills vectors.
std::optional<size_t> long_dimension(const FuncContents& f, int lanes, const SizeEstimate& sizes) {
  for (size_t d = 1; d < f.args.size(); ++d) {
    if (sizes.extent(f, d).value_or(0) >= lanes) return d;
  }
  return std::nullopt;
}

bool is_pure_everywhere(const FuncContents& f, const Definition& stage) {
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, stage, d)) return false;
  }
  return true;
}

// The work of one element, and how many elements of others it takes along the row.
struct RowWork {
  double operations = 0, accesses = 0;
};
RowWork work_along(const FuncContents& f, const Definition& stage) {
  RowWork result{0, static_cast<double>(stage.values.size())};
  std::unordered_set<const ExprNode*> seen;
  for (const Expr& root : roots_with_inlined(stage)) {
    walk(root, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      result.operations += operations_of(e);
      const auto* call = e.as<Call>();
      if (call && call->call_type != CallType::Operator && !call->args.empty())
        result.accesses += uses_variable(call->args[0], f.args[0]) ? 1 : 0;
      return true;
    });
  }
  return result;
}

// Compares vectors along rows of `extent` elements, one for each row, with `extent` vectors of many rows.
bool is_worth_turning(const RowWork& work, double extent, double lanes) {
  const double along = lanes * work.operations;
  const double across =
      extent * (work.operations + lanes * planning::strided_access_operations * work.accesses);
  return across * 2 < along;
}

}  // namespace

bool schedule_short_rows(const FuncContents& f, int index, Stage& stage, int lanes,
                         const SizeEstimate& sizes) {
  const Definition& definition = f.stage(index);
  if (f.args.size() < 2 || !definition.rvars.empty() || !is_pure_everywhere(f, definition))
    return false;
  const auto extent = sizes.extent(f, 0);
  const auto along = long_dimension(f, lanes, sizes);
  if (!extent || *extent < 1 || !along ||
      !is_worth_turning(work_along(f, definition), static_cast<double>(*extent), lanes))
    return false;
  const Var row(f.args[0]), rows(f.args[*along]);
  const Var lane(inner_loop(f, index, rows.name()));
  stage.split(rows, rows, lane, lanes, TailStrategy::GuardWithIf).vectorize(lane);
  const Var copy(inner_loop(f, index, row.name()));
  stage.split(row, row, copy, static_cast<int>(*extent), TailStrategy::GuardWithIf).unroll(copy);
  std::vector<VarOrRVar> order{lane, copy, row, rows};
  for (size_t d = 1; d < f.args.size(); ++d) {
    if (d != *along) order.push_back(Var(f.args[d]));
  }
  stage.reorder(order);
  int64_t tasks = 1;
  for (size_t i = order.size(); i-- > 3 && tasks < sizes.machine().enough_tasks();) {
    const auto arg = std::ranges::find(f.args, order[i].name()) - f.args.begin();
    const int64_t count = sizes.extent(f, static_cast<size_t>(arg)).value_or(lanes);
    stage.parallel(order[i]);
    tasks *= i == 3 ? count / lanes : count;
  }
  return true;
}

}  // namespace retrograde::autoschedule
