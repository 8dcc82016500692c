// phases -- lanes lie a few points apart, and unrolled copies take the points between them.
//
//   y, x:16, r, vector x                     =>     y, x:32, r, unroll x%2, vector x:2     if f(x / 2) or f(x % 2) is read
//   y, x:32, r, unroll c, unroll x:16, vector x   =>   y, x:32, r, unroll c, unroll x%2, vector x:2
//   weights  root                                 =>   weights  root  (x, k)     also with operands along the lanes
//
// In each copy the remainder is a constant, and lanes of the quotient are neighbours in memory. Lanes of neighbouring points
// would be interleaved or gathered instead.
// Legal: L1, since iterations of pure loops never meet; L4: a step of all points of the copies stands outside; L5.
#include <algorithm>
#include <set>

#include "autoschedule/moves/edit.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t most_phases = 4;

// The numbers by which indices of the stage divide sums that the iterator moves, and of which they take remainders.
std::set<int64_t> periods_along(const StageNode& stage, int iterator) {
  std::set<int64_t> periods;
  for (const Access& read : stage.reads) {
    for (const IndexForm& form : read.index) {
      if (form.coefficient(iterator) != 0) periods.insert({form.divisor, form.modulus});
      for (const OpaqueTerm& term : form.opaque) {
        if (term.value.from_data || !term.expr.defined() ||
            !(term.value.depends() & set_of(iterator)))
          continue;
        ir::walk(term.expr, [&](const Expr& e) -> bool {
          const bool divides = e.kind() == Kind::Div || e.kind() == Kind::Mod;
          if (divides) periods.insert(as_const_int(e.as<Binary>()->b).value_or(1));
          return true;
        });
      }
    }
  }
  return periods;
}

std::vector<Nest> with_phases(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  const auto lane_loop = vector_loop(nest);
  if (!lane_loop || *lane_loop + 1 != nest.loops.size()) return {};
  const int iterator = nest.loops[*lane_loop].iterator;
  const int64_t lanes = outer_step(nest, iterator, 1);
  if (lanes == 0 || is_reduction(context, stage, iterator)) return {};
  std::vector<Nest> nests;
  for (const int64_t period : periods_along(context.accesses.stage(stage), iterator)) {
    if (period < 2 || period > most_phases) continue;
    Nest phases = nest;
    const size_t blocks = *find_loop(nest, iterator, lanes);
    const bool has_copies = phases.loops[blocks].kind == ForType::Unrolled;
    if (has_copies && outer_step(nest, iterator, lanes) == period * lanes) {
      phases.loops.erase(phases.loops.begin() + static_cast<std::ptrdiff_t>(blocks));
    } else if (!has_copies && blocks >= shared_loops(plan, stage) &&
               period * lanes <=
                   points_inside(extents, nest, static_cast<int>(blocks) - 1, iterator)) {
      phases.loops[blocks].step = period * lanes;
    } else {
      continue;
    }
    phases.loops.back().step = period;
    insert_step(phases, iterator, 1, phases.loops.size() - 1, ForType::Unrolled);
    if (body_operations(plan, context, stage, phases, extents) <= most_body_operations)
      nests.push_back(std::move(phases));
  }
  return nests;
}

}  // namespace

// Tiles come with phases, since no other move changes loops of phases.
std::vector<Plan> phases(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans = with_nests(plan, func, context, with_phases);
  if (plans.empty()) return plans;
  for (const Plan& tiled : find_move("register_tile")->apply(plan, func, context)) {
    for (Plan& phases : with_nests(tiled, func, context, with_phases))
      add(plans, std::move(phases));
  }
  // Operands that lie across the lanes would hide what phases gain.
  const size_t count = plans.size();
  for (size_t i = 0; i < count; ++i) {
    for (const StageNode& stage : context.accesses.func(func).stages)
      add(plans, with_turned_operands(plans[i], stage.id, context));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
