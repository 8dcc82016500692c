// parallelise -- which loops of a stage at root run in parallel.
//
//   y, x:16, vector x     =>     parallel y, x:16, vector x
//                         =>     parallel y:64, y, x:16, vector x       with as many rows as make many tasks
//   parallel y, ...       =>     y, ...                                 too little work for a launch, or one thread
//   r.t, r.y, r.x         =>     r.t, parallel r.y, r.x                 each step of a recurrence, its rows at once
//   r.y, r.x              =>     atomic  parallel r.y, r.x              a large scatter, where bits may differ
//
// Legal: L1, L6, since iterations of pure loops write different elements, and those of a reduction only run at once if they
// don't meet while the loops around them stand still. A window that is stored outside of a loop is
// dropped with the plan if the loop becomes parallel (P3).
#include <algorithm>
#include <bit>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

// Threads seldom meet in a large Func.
bool is_large(const Context& context, FuncId func) {
  double elements = 1;
  for (size_t d = 0; d < context.accesses.func(func).func->args.size(); ++d)
    elements *= static_cast<double>(context.sizes.of(func, d).estimate);
  return elements >= static_cast<double>(uncontended_lines * line_elements);
}

// The serial loops of a scatter that no thread could share, in parallel; nullopt: it is another stage, or each of its
// updates has to take its terms in order.
std::optional<Nest> with_atomic_updates(const StageLoops& loops, const Nest& serial) {
  const auto& [plan, context, stage, nest, extents] = loops;
  if (context.atomics != Atomics::OfAll || serial.concurrency != Concurrency::Independent ||
      vector_loop(serial) || body_depth(serial) == 0 ||
      !context.dependences.may_be_atomic(stage, context.atomics) || !is_large(context, stage.func))
    return std::nullopt;
  for (size_t d = 0; d < body_depth(serial); ++d)
    if (may_run_at_once(context, stage, serial, d)) return std::nullopt;
  Nest atomic = serial;
  atomic.concurrency = Concurrency::Atomic;
  const int64_t each = trips(extents, atomic, 0) / context.machine.many_tasks();
  if (each > 1) {
    const auto rows = static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(each)));
    insert_step(atomic, atomic.loops[0].iterator, rows * atomic.loops[0].step, 0);
  }
  atomic.loops[0].kind = ForType::Parallel;
  return atomic;
}

std::vector<Nest> in_parallel(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  Nest serial = nest;
  for (Loop& loop : serial.loops) {
    if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
  }
  if (context.machine.threads == 1) return {serial};
  Nest outermost = serial;
  run_in_parallel(outermost, context, stage);
  std::vector<Nest> nests{outermost};
  size_t d = 0;
  while (d < body_depth(serial) && !may_run_at_once(context, stage, serial, d)) ++d;
  if (d < body_depth(serial)) {
    Nest chunks = serial;
    const int16_t first = chunks.loops[d].iterator;
    if (d + 1 < chunks.loops.size() && chunks.loops[d + 1].iterator == first)
      drop_loop(chunks, d + 1);
    const int64_t each = trips(extents, chunks, d) / context.machine.many_tasks();
    if (each > 1) {
      const auto rows = static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(each)));
      insert_step(chunks, first, rows * chunks.loops[d].step, d, ForType::Parallel);
      nests.push_back(std::move(chunks));
    }
  }
  if (std::optional<Nest> atomic = with_atomic_updates(loops, serial)) nests.push_back(*atomic);
  nests.push_back(std::move(serial));
  return nests;
}

}  // namespace

void run_in_parallel(Nest& nest, const Context& context, StageId stage) {
  if (context.machine.threads == 1) return;
  const Cover extents = whole_cover(stage, context.sizes);
  int64_t chunks = 1;
  for (size_t d = 0; d < body_depth(nest) && chunks < context.machine.enough_tasks(); ++d) {
    if (!may_run_at_once(context, stage, nest, d)) {
      if (chunks > 1) return;
      continue;  // serial, around parallel ones
    }
    // The body of the innermost loop is a few vectors: many iterations are one chunk.
    const int64_t all = trips(extents, nest, d);
    const auto each = static_cast<uint64_t>(chunks * all / context.machine.many_tasks());
    if (d + 1 == body_depth(nest) && each > 1) {
      const Loop& loop = nest.loops[d];
      insert_step(nest, loop.iterator, static_cast<int64_t>(std::bit_floor(each)) * loop.step, d);
    }
    nest.loops[d].kind = ForType::Parallel;
    chunks *= all;
  }
}

std::vector<Plan> parallelise(const Plan& plan, FuncId func, const Context& context) {
  if (plan.of(func).placement.compute.kind != Level::Kind::Root) return {};
  return with_nests(plan, func, context, in_parallel);
}

}  // namespace retrograde::planning::moves
