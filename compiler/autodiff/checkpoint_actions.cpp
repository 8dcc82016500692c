#include "autodiff/checkpoint_actions.h"

#include <algorithm>
#include <vector>

#include "autodiff/revolve.h"
#include "frontend/buffer.h"
#include "ir/build.h"

namespace retrograde::ir {

namespace {

using Rows = std::vector<std::array<int, 3>>;  // action, step, slot

void add_rows(const RevolveAction& a, Rows& rows) {
  auto add = [&](Action action) {
    rows.push_back({static_cast<int>(action), a.step, std::max(a.slot, 0)});
  };
  switch (a.kind) {
    case RevolveAction::Kind::Store:
      add(Action::Store);
      break;
    case RevolveAction::Kind::Restore:
      add(Action::Restore);
      break;
    case RevolveAction::Kind::Advance:
      add(Action::Advance);
      break;
    case RevolveAction::Kind::Reverse:
      add(Action::Record);
      add(Action::Adjoint);
      break;
  }
}

std::vector<RevolveAction> reversals_alone(int steps) {
  std::vector<RevolveAction> result;
  for (int step = steps - 1; step >= 0; --step)
    result.push_back({RevolveAction::Kind::Reverse, step});
  return result;
}

Buffer<int> in_memory(const Rows& rows) {
  Buffer<int> table(3, static_cast<int>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    for (int c = 0; c < 3; ++c) table(c, static_cast<int>(i)) = rows[i][static_cast<size_t>(c)];
  }
  return table;
}

}  // namespace

ActionTable action_table(int steps, int states, bool needs_values) {
  Rows rows;
  for (const RevolveAction& a :
       needs_values ? revolve_schedule(steps, states) : reversals_alone(steps)) {
    add_rows(a, rows);
  }
  ActionTable result;
  result.rows = make_const(Int(32), static_cast<int64_t>(rows.size()));
  for (size_t kind = 0; kind < action_kinds; ++kind) {
    result.counts[kind] = make_const(Int(32), std::count_if(rows.begin(), rows.end(), [&](auto& r) {
                                       return r[0] == static_cast<int>(kind);
                                     }));
  }
  // The Expr shares the memory.
  result.entry = [table = in_memory(rows).parameter()](int column, const Expr& row) {
    return call_image(table->name, table->type, {Expr(column), row}, SymbolRef(table));
  };
  return result;
}

}  // namespace retrograde::ir
