// scatter_lanes -- a scatter runs in vectors: along a dimension that its places don't depend on, which is innermost in
// memory, so that lanes lie together and never meet; or along its iterations, whose terms are added lane by lane. Short
// loops of the reduction are copies inside of a vector, which have in common what decides their places.
//
//   sum  root                                      sum  root  (c, x, y)
//     .1  c, tap, r.y, r.x                =>         .0  y, x, c:4, vector c
//                                                    .1  c:4, r.y, r.x, unroll tap, vector c
//                                         =>       sum  root
//                                                    .1  racing  c, r.y, r.x:16, unroll tap, vector r.x
//   out  root  parallel c, y, x, vector x           =>   out  root  parallel c:4, y, x:16, c, vector x
//                                                      sum  at out/c:4  (c, x, y)
//
// Legal: L4, L5, L6: iterations of a pure variable write different elements, and lowering runs lanes that may meet in
// order. L2 holds without short loops: with copies of them, an element takes its terms in another order, so the update
// commutes. Outputs keep their layout.
// Not done: lanes along privatised copies, whose rows lie apart.
#include <algorithm>
#include <bit>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"

namespace retrograde::planning::moves {

namespace {

constexpr int most_dimensions = 2;

// Whether the reduction decides where the stage writes.
bool scatters(const Context& context, const StageNode& stage) {
  const auto count = static_cast<int>(stage.iterators.size());
  for (int i = 0; i < count; ++i) {
    if (is_reduction(context, stage.id, i) && (stage.write.moved_by() & set_of(i))) return true;
  }
  return false;
}

// Whether data decide where the stage adds, at places that move with the iterator.
bool is_placed_by(const StageNode& stage, int iterator) {
  return std::ranges::any_of(stage.write.index, [&](const IndexForm& form) {
    return std::ranges::any_of(form.opaque, [&](const OpaqueTerm& term) {
      return (term.value.depends() & set_of(iterator)) != 0;
    });
  });
}

// Whether the stage adds terms to elements of its Func, and reads no others.
bool adds_in_any_order(const Context& context, const StageNode& stage) {
  const auto is_other = [&](const Access& read) {
    return read.of == stage.id.func && !read.same_place(stage.write);
  };
  return stage.id.stage > 0 && std::ranges::none_of(stage.reads, is_other) &&
         context.dependences.commutes(stage.id);
}

// Whether lanes along the dimension have nothing in common: they read rows that lie apart and add at places of their own.
bool lie_apart(const Context& context, const StageNode& stage, int dimension) {
  const auto found = std::ranges::find(stage.iterators, dimension, &Iterator::dimension);
  const auto i = static_cast<int>(found - stage.iterators.begin());
  const auto moves_place = [&](const IndexForm& form) {
    const bool is_own = &form == &stage.write.index[static_cast<size_t>(dimension)];
    return !is_own && (form.moved_by() & set_of(i)) != 0;
  };
  const auto is_row = [&](const Access& read) {
    return lane_form(read, i, schedule_lanes, context.sizes, {line_elements}).kind ==
           LaneForm::Kind::Contiguous;
  };
  return std::ranges::any_of(stage.write.index, moves_place) &&
         std::ranges::none_of(stage.reads, is_row);
}

bool is_pure_in_all_stages(const Context& context, FuncId func, int dimension) {
  const std::vector<StageNode>& stages = context.accesses.func(func).stages;
  return std::ranges::all_of(stages, [&](const StageNode& stage) {
    return std::ranges::find(stage.iterators, dimension, &Iterator::dimension) !=
           stage.iterators.end();
  });
}

// Whether the iterator decides selects of the stage, which copies for each of its points don't need.
bool decides_selects(const StageNode& stage, int iterator) {
  return std::ranges::any_of(stage.operations, [&](const OperationCount& operation) {
    return (operation.decided_by & set_of(iterator)) != 0;
  });
}

// Copies of short loops of a reduction inside of all others but the lanes, which are innermost: first of those that decide
// selects. `additions`: of a copy.
void copy_short_loops(Nest& nest, const Plan& plan, const Context& context, StageId stage,
                      int64_t additions) {
  const StageNode& node = context.accesses.stage(stage);
  if (!adds_in_any_order(context, node)) return;
  int64_t size = operations(plan, context, stage) + additions;
  const auto is_short = [&](Loop& loop) {
    if (!is_reduction(context, stage, loop.iterator) || loop.kind != ForType::Serial) return false;
    const Extent extent = context.sizes.of(stage, loop.iterator);
    const bool is_one = loop.step == 1 && outer_step(nest, loop.iterator, 1) == 0 &&
                        extent.is_constant() && extent.high < schedule_lanes;
    if (!is_one || size * extent.high > most_body_operations) return false;
    size *= extent.high;
    loop.kind = ForType::Unrolled;
    return true;
  };
  std::vector<Loop> copies;
  for (const bool decides : {true, false}) {
    for (size_t d = body_depth(nest); d-- > 0;) {
      if (decides_selects(node, nest.loops[d].iterator) != decides || !is_short(nest.loops[d]))
        continue;
      copies.insert(copies.begin(), nest.loops[d]);
      nest.loops.erase(nest.loops.begin() + static_cast<std::ptrdiff_t>(d));
    }
  }
  nest.loops.insert(nest.loops.begin() + static_cast<std::ptrdiff_t>(body_depth(nest)),
                    copies.begin(), copies.end());
}

// Loops of a scatter whose lanes are iterations, from those along rows without lanes; false: none fills a vector.
bool run_in_iterations(Nest& nest, const Plan& plan, const Context& context, StageId stage,
                       const Cover& extents) {
  const StageNode& node = context.accesses.stage(stage);
  if (!adds_in_any_order(context, node)) return false;
  copy_short_loops(nest, plan, context, stage, schedule_lanes);
  const auto last =
      std::ranges::find_if(nest.loops.rbegin(), nest.loops.rend(),
                           [](const Loop& loop) { return loop.kind != ForType::Unrolled; });
  if (last == nest.loops.rend() || !is_placed_by(node, last->iterator) ||
      !is_reduction(context, stage, last->iterator))
    return false;
  const int64_t lanes = lanes_for(plan, stage, extents[static_cast<size_t>(last->iterator)]);
  if (lanes == 1) return false;
  run_inside(nest, last->iterator, lanes, ForType::Vectorized);
  nest.concurrency = Concurrency::Racing;
  return true;
}

std::optional<Plan> in_iterations(const Plan& plan, FuncId func, const Context& context) {
  FuncPlan rows = plan.of(func);
  run_along_rows(rows, plan, context, func, loop_extents(plan, context, {func, 0}), INT64_MAX);
  FuncPlan changed = plan.of(func);
  for (const StageNode& stage : context.accesses.func(func).stages) {
    if (!scatters(context, stage)) continue;
    Nest& nest = rows.nests[static_cast<size_t>(stage.id.stage)];
    if (run_in_iterations(nest, plan, context, stage.id, loop_extents(plan, context, stage.id)))
      changed.nests[static_cast<size_t>(stage.id.stage)] = std::move(nest);
  }
  return with_func(plan, func, std::move(changed), context, Terms::InAnyOrder);
}

std::optional<Plan> along_dimension(const Plan& plan, FuncId func, const Context& context,
                                    FuncPlan changed, int dimension, const Cover& extents) {
  store_first(changed.storage, dimension);
  run_along_rows(changed, plan, context, func, extents, 1);
  for (const StageNode& stage : context.accesses.func(func).stages) {
    Nest& nest = changed.nests[static_cast<size_t>(stage.id.stage)];
    if (!vector_loop(nest)) return std::nullopt;
    if (scatters(context, stage)) copy_short_loops(nest, plan, context, stage.id, 1);
  }
  return with_func(plan, func, std::move(changed), context, Terms::InAnyOrder);
}

// The nest in which a step of an iterator is outside of all loops but those of `around`, and its points just around the
// body; nullopt: they are no such loops.
std::optional<Nest> in_slices_along(Nest nest, int iterator, int64_t step, IteratorSet around,
                                    size_t& depth) {
  const auto is_own = [&](const Loop& loop) { return loop.iterator == iterator; };
  const auto is_around = [&](const Loop& loop) { return (set_of(loop.iterator) & around) != 0; };
  const auto body = nest.loops.begin() + static_cast<std::ptrdiff_t>(body_depth(nest));
  if (std::ranges::count_if(nest.loops, is_own) != 1 ||
      std::any_of(body, nest.loops.end(), [&](const Loop& l) { return is_own(l) || is_around(l); }))
    return std::nullopt;
  std::erase_if(nest.loops, is_own);
  for (Loop& loop : nest.loops) {
    if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
  }
  depth = static_cast<size_t>(std::ranges::count_if(nest.loops, is_around));
  const auto end = nest.loops.begin() + static_cast<std::ptrdiff_t>(body_depth(nest));
  std::stable_partition(nest.loops.begin(), end, is_around);
  insert_step(nest, iterator, 1, body_depth(nest));
  insert_step(nest, iterator, step, depth);
  return nest;
}

// Slices along the dimension are computed in the loop of the consumer over them.
std::optional<Plan> in_slices(const Plan& plan, FuncId func, const Context& context,
                              int dimension) {
  const auto is_root = [&](FuncId f) {
    return plan.of(f).placement.compute.kind == Level::Kind::Root;
  };
  const std::optional<StageId> reader = only_reader(plan, context, func);
  if (!reader || !is_root(func) || !is_root(reader->func) || !has_loops(plan, reader->func) ||
      plan.of(reader->func).nests.size() > 1)
    return std::nullopt;
  IteratorSet along = 0, around = 0;
  for_each_read(plan, context, *reader, [&](const Access& read, const MovedIndices& moved) {
    for (size_t d = 0; read.of == func && d < moved.size(); ++d) {
      const bool is_apart = is_pure_in_all_stages(context, func, static_cast<int>(d));
      if (static_cast<int>(d) == dimension)
        along |= moved[d];
      else if (is_apart)
        around |= moved[d];
    }
  });
  const int iterator = std::countr_zero(along);
  const int64_t lanes = lanes_for(plan, {func, 0}, schedule_lanes / 4);
  if (!std::has_single_bit(along) || (along & around) != 0 || lanes == 1 ||
      !fits(lanes, context.sizes.of(*reader, iterator).estimate))
    return std::nullopt;
  size_t depth = 0;
  FuncPlan consumer = plan.of(reader->func);
  std::optional<Nest> nest = in_slices_along(consumer.nests[0], iterator, lanes, around, depth);
  if (!nest) return std::nullopt;
  run_in_parallel(*nest, context, *reader);
  consumer.nests[0] = std::move(*nest);
  const auto sliced = with_func(plan, reader->func, std::move(consumer), context);
  if (!sliced) return std::nullopt;
  FuncPlan changed = plan.of(func);
  changed.placement.compute = {Level::Kind::At, {*reader, static_cast<int16_t>(depth)}};
  const Cover box = Covers(*sliced, context.sizes).box(func, changed.placement.compute);
  return along_dimension(*sliced, func, context, std::move(changed), dimension, box);
}

}  // namespace

std::vector<Plan> scatter_lanes(const Plan& plan, FuncId func, const Context& context) {
  const std::vector<StageNode>& stages = context.accesses.func(func).stages;
  std::vector<Plan> plans;
  if (!has_loops(plan, func) || std::ranges::none_of(stages, [&](const StageNode& stage) {
        return scatters(context, stage);
      }))
    return plans;
  add(plans, in_iterations(plan, func, context));
  if (!may_run_in_loops(plan, context, func)) return plans;
  const Cover extents = loop_extents(plan, context, {func, 0});
  // Lanes of a recurrence have nothing in common, so that a few are no better than one.
  const bool has_slices = std::ranges::any_of(stages, [](const StageNode& stage) {
    return std::ranges::any_of(stage.write.index, &IndexForm::has_data);
  });
  int dimensions = 0;
  for (int d = 0; d < static_cast<int>(extents.size()) && dimensions < most_dimensions; ++d) {
    const auto are_apart = [&](const StageNode& stage) { return lie_apart(context, stage, d); };
    if (!is_pure_in_all_stages(context, func, d) || std::ranges::any_of(stages, are_apart))
      continue;
    ++dimensions;
    add(plans, along_dimension(plan, func, context, plan.of(func), d, extents));
    if (has_slices) add(plans, in_slices(plan, func, context, d));
  }
  return plans;
}

}  // namespace retrograde::planning::moves
