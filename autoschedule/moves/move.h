// move.h -- moves: plans that differ from a plan in how one Func runs.
//
//   tile of out      out  root  y, x:16, vector x     =>     out  root  y:8, y, x:16, vector x
//                                                            out  root  y:8, x:64, y, x:16, vector x
//
// A move is a pure function. It only gives legal plans, so a search needs no checks of its own. It gives few of them,
// with sizes at which something changes: the cost decides which of them are good. The loops of other Funcs stay, except that
// register_tile may store operands and consumers in another order, and compute_in_tile tiles the consumer. Placements in
// a loop that moves follow it, and a plan in which such a loop is gone isn't given.
//
// The conditions under which a plan is legal have numbers, which code and tests mention:
//
//   L1   no dependence is carried by loops that change their order or kind
//   L2   the order in which one element takes its terms stays, so that its bits do; moves that change it say so
//   L3   all reads are inside of the loop in which a Func is placed (P2), and the region that they need is bounded
//   L4   extents of vectors and of unrolled loops are constant
//   L5   the code that inlining and unrolling make is bounded
//   L6   iterations that run in parallel write different elements
//   L7   no chain of additions gets longer than one may be (access/long_sums.h)
//   L8   no extern stage, no opaque Func and, for processors, no loop of a device changes
//   L9   windows that are stored keep the rows that are read again
//   L11  loops that stages share stay equal
//
// On a device (`Context::device`), `root` makes kernels, and only `inline_func`, `root`, `kernels` and `compute_in_thread` have
// plans for them:
//
//   L10  a kernel calls nothing of the host
#pragma once

#include <span>
#include <vector>

#include "autoschedule/access/dependences.h"
#include "autoschedule/access/sizes.h"
#include "autoschedule/machine/device.h"
#include "autoschedule/machine/machine.h"
#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The program and the machine that moves are for. It outlives plans.
struct Context {
  const AccessGraph&
      accesses;  // of the program's outputs; its Funcs have the numbers of the plan's
  const SizeModel& sizes;
  const Machine& machine;
  Dependences& dependences;        // of the same access graph
  const Device* device = nullptr;  // whose kernels the program is; null: the processor runs it
  Atomics atomics = Atomics::OfIntegers;  // on the device
};

// Plans that differ from `plan` in how `func` runs, and in some cases its operands and consumers. All invariants hold for
// them if they hold for `plan`.
using MoveFunction = std::vector<Plan> (*)(const Plan& plan, FuncId func, const Context& context);
struct Move {
  const char* name;
  MoveFunction apply;
  bool may_place;     // the Func may be computed elsewhere
  bool changes_bits;  // terms may be added in another order, in shorter chains
  bool on_device;     // it also has plans for a device; the others have none there

  bool is_for(const Context& context) const { return on_device || !context.device; }
};
std::span<const Move> all_moves();               // list.def
const Move* find_move(const std::string& name);  // null: there is none

}  // namespace retrograde::planning
