#include "autodiff/time/checkpoint_actions.h"

#include <algorithm>
#include <vector>

#include "autodiff/time/revolve.h"
#include "frontend/data/buffer.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

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

Buffer<int> in_memory(const Rows& rows) {
  Buffer<int> table(3, static_cast<int>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    for (int c = 0; c < 3; ++c) table(c, static_cast<int>(i)) = rows[i][static_cast<size_t>(c)];
  }
  return table;
}

}  // namespace

ActionTable reversals_alone(const Expr& steps) {
  ActionTable result;
  result.rows = steps;
  result.counts.fill(make_zero(Int(32)));
  result.counts[static_cast<size_t>(Action::Adjoint)] = steps;
  result.entry = [steps](int column, const Expr& row) {
    return column == 0   ? Expr(static_cast<int>(Action::Adjoint))
           : column == 1 ? simplify(steps - 1 - row)
                         : make_zero(Int(32));
  };
  return result;
}

ActionTable action_table(int steps, int states) {
  Rows rows;
  for (const RevolveAction& a : revolve_schedule(steps, states)) add_rows(a, rows);
  ActionTable result;
  result.rows = make_const(Int(32), static_cast<int64_t>(rows.size()));
  for (size_t kind = 0; kind < action_kinds; ++kind) {
    result.counts[kind] = make_const(Int(32), std::ranges::count_if(rows, [&](auto& r) {
                                       return r[0] == static_cast<int>(kind);
                                     }));
  }
  // The Expr keeps the memory alive.
  result.entry = [table = in_memory(rows).parameter()](int column, const Expr& row) {
    return call_image(table->name, table->type, {Expr(column), row}, SymbolRef(table));
  };
  return result;
}

}  // namespace retrograde::autodiff
