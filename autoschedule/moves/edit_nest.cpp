#include <algorithm>
#include <functional>
#include <map>
#include <tuple>
#include <utility>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"
#include "autoschedule/plan/nest.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t points_of_fusion = INT32_MAX;  // where no step outside bounds them

bool is_plain(const Nest& nest) {
  if (!nest.fusions.empty()) return false;
  for (size_t d = 0; d < nest.loops.size(); ++d) {
    if (is_gpu(nest.loops[d].kind) || nest.loops[d].in_blocks || is_phase(nest, d)) return false;
  }
  return true;
}

bool has_range(const IndexForm& form, const SizeModel& sizes) {
  return sizes.range(form.within).is_bounded() ||
         std::ranges::all_of(form.opaque, [&](const OpaqueTerm& term) {
           return !term.value.from_data || term.range.is_bounded();
         });
}

// Steps that divide the next larger one have no tail. Where a tail would compute more than is asked for, regions of
// other Funcs would change, so all others are guards.
void set_tails(Nest& nest, int iterator) {
  int64_t larger = 0;
  for (const Part& part : parts_of(nest, iterator)) {
    Loop& loop = nest.loops[*find_loop(nest, iterator, part.step)];
    const bool has_tail = part.step > 1 && (larger == 0 || larger % part.step != 0);
    loop.tail = has_tail ? TailStrategy::GuardWithIf : TailStrategy::Auto;
    larger = part.step;
  }
}

// Serial loops of one stage.
Nest row_loops(const Plan& plan, const Context& context, StageId stage,
               const std::vector<int16_t>& order, const Cover& extents, int64_t min_lanes) {
  const graph::FuncContents& f = *plan.program->funcs[static_cast<size_t>(stage.func)];
  const StageNode& node = context.accesses.stage(stage);
  Nest nest = loops_of_definition(f, stage.stage);
  const auto rank = [&](const Loop& loop) {
    const Iterator& iterator = node.iterators[static_cast<size_t>(loop.iterator)];
    if (iterator.kind == Iterator::Kind::Reduction) return -1;
    return static_cast<int>(std::ranges::find(order, iterator.dimension) - order.begin());
  };
  std::ranges::stable_sort(nest.loops, std::greater(), rank);
  const auto first = std::ranges::find(nest.loops, 0, rank);
  if (first == nest.loops.end()) return nest;
  const int64_t lanes = lanes_for(plan, stage, extents[static_cast<size_t>(order[0])]);
  if (lanes > 1 && lanes >= min_lanes)
    run_inside(nest, first->iterator, lanes, ForType::Vectorized);
  return nest;
}

// Whether threads save more than the time until they run.
bool is_worth_a_launch(const Plan& plan, const Context& context, StageId stage) {
  const double each = double(operations(plan, context, stage)) + cache_trip_operations;
  return each * product_of(whole_cover(stage, context.sizes)) > launch_operations;
}

}  // namespace

// ---- questions ----

bool is_editable(const Plan& plan, FuncId func) {
  const FuncPlan& own = plan.of(func);
  const bool in_memory =
      own.storage.memory == MemoryType::Auto || own.storage.memory == MemoryType::Heap;
  return own.opacity == Opacity::None && in_memory && std::ranges::all_of(own.nests, is_plain);
}

bool is_editable(const Plan& plan, FuncId func, const Context& context) {
  const FuncPlan& own = plan.of(func);
  return is_editable(plan, func) ||
         (context.device && own.opacity == Opacity::None && own.storage.memory == MemoryType::Auto);
}

bool has_loops(const Plan& plan, FuncId func) {
  const Level::Kind kind = plan.of(func).placement.compute.kind;
  return is_editable(plan, func) && (kind == Level::Kind::Root || kind == Level::Kind::At);
}

std::vector<StageId> all_readers(const Plan& plan, const Context& context, FuncId func) {
  std::vector<StageId> result;
  std::vector<FuncId> read{func};
  std::vector<uint64_t> seen(plan.funcs.size());  // by Func, a bit for each of its first stages
  for (size_t i = 0; i < read.size(); ++i) {
    for (const StageId reader : context.accesses.consumers(read[i])) {
      uint64_t& stages = seen[static_cast<size_t>(reader.func)];
      const uint64_t own = uint64_t{1} << std::min<int>(reader.stage, 63);
      const bool may_be_known = std::exchange(stages, stages | own) & own;
      if (may_be_known && (reader.stage < 63 || std::ranges::find(result, reader) != result.end()))
        continue;
      result.push_back(reader);
      if (is_inlined(plan, reader.func)) read.push_back(reader.func);
    }
  }
  return result;
}

bool has_bounded_region(const Plan& plan, const Context& context, FuncId func) {
  const std::vector<StageId> readers = all_readers(plan, context, func);
  const auto leads_to = [&](FuncId read) {
    return read == func || (std::ranges::find(readers, read, &StageId::func) != readers.end() &&
                            is_inlined(plan, read));
  };
  return std::ranges::all_of(readers, [&](StageId reader) {
    const std::vector<Access>& reads = context.accesses.stage(reader).reads;
    return std::ranges::all_of(reads, [&](const Access& read) {
      return !leads_to(read.of) || std::ranges::all_of(read.index, [&](const IndexForm& form) {
        return has_range(form, context.sizes);
      });
    });
  });
}

bool is_reduction(const Context& context, StageId stage, int iterator) {
  const StageNode& node = context.accesses.stage(stage);
  return node.iterators[static_cast<size_t>(iterator)].kind == Iterator::Kind::Reduction;
}

bool is_free(const Context& context, StageId stage, int iterator) {
  return !is_reduction(context, stage, iterator) ||
         context.dependences.may_run_at_once(stage, iterator);
}

bool may_run_at_once(const Context& context, StageId stage, const Nest& nest, size_t depth) {
  const int iterator = nest.loops[depth].iterator;
  if (!is_reduction(context, stage, iterator)) return true;
  IteratorSet around = 0;
  for (size_t d = 0; d < nest.loops.size(); ++d) {
    const IteratorSet own = set_of(nest.loops[d].iterator);
    around = d < depth ? around | own : around & ~own;
  }
  return context.dependences.may_run_at_once(stage, iterator, around);
}

std::optional<size_t> find_loop(const Nest& nest, int iterator, int64_t step) {
  const auto found = std::ranges::find_if(
      nest.loops, [&](const Loop& loop) { return loop.iterator == iterator && loop.step == step; });
  if (found == nest.loops.end()) return std::nullopt;
  return static_cast<size_t>(found - nest.loops.begin());
}

int64_t outer_step(const Nest& nest, int iterator, int64_t step) {
  const Part* larger = next_larger(nest, iterator, step);
  return larger ? larger->step : 0;
}

size_t innermost_loop(const Nest& nest, int iterator) { return *find_loop(nest, iterator, 1); }

std::optional<size_t> vector_loop(const Nest& nest) {
  const auto found = std::ranges::find(nest.loops, ForType::Vectorized, &Loop::kind);
  if (found == nest.loops.end()) return std::nullopt;
  return static_cast<size_t>(found - nest.loops.begin());
}

size_t shared_loops(const Plan& plan, StageId stage) {
  const std::optional<LoopRef>& own = plan.nest(stage).shared_with;
  int depth = own ? own->depth : -1;
  for (const auto& func : plan.funcs) {
    for (const Nest& nest : func->nests) {
      if (nest.shared_with && nest.shared_with->stage == stage)
        depth = std::max<int>(depth, nest.shared_with->depth);
    }
  }
  return static_cast<size_t>(depth + 1);
}

size_t body_depth(const Nest& nest) {
  size_t depth = nest.loops.size();
  const auto is_body = [&](ForType kind) {
    return kind == ForType::Vectorized || kind == ForType::Unrolled;
  };
  while (depth > 0 && is_body(nest.loops[depth - 1].kind)) --depth;
  return depth;
}

Cover loop_extents(const Plan& plan, const Context& context, StageId stage) {
  Covers covers(plan, context.sizes);
  Cover extents = covers.inside(stage, around_all_loops);
  const auto& [compute, store, hoist] = plan.of(stage.func).placement;
  const bool has_window =
      compute.kind == Level::Kind::At && store.kind != Level::Kind::Undecided && store != compute;
  const StageId host = compute.loop.stage;
  if (!has_window || !is_editable(plan, host.func)) return extents;
  const Cover around = covers.inside(host, around_all_loops);
  const bool is_near = store.kind == Level::Kind::At && store.loop.stage == host;
  const int last = is_near ? store.loop.depth : around_all_loops;
  Level level = compute;
  std::vector<int64_t> box = covers.box(stage.func, level), added = box;
  while (level.loop.depth > last) {
    const int64_t moves =
        trips(around, plan.nest(host), static_cast<size_t>(level.loop.depth--)) - 1;
    const std::vector<int64_t> all = level.loop.depth == around_all_loops
                                         ? whole_cover({stage.func, 0}, context.sizes)
                                         : covers.box(stage.func, level);
    for (size_t d = 0; d < box.size(); ++d) {
      if (all[d] > box[d] && moves > 0)
        added[d] = std::min(added[d], (all[d] - box[d] + moves - 1) / moves);
    }
    box = all;
  }
  for (size_t i = 0; i < extents.size(); ++i) {
    const Iterator& iterator = context.accesses.stage(stage).iterators[i];
    if (iterator.kind == Iterator::Kind::Pure)
      extents[i] = added[static_cast<size_t>(iterator.dimension)];
  }
  return extents;
}

int64_t points_inside(const Cover& extents, const Nest& nest, int depth, int iterator) {
  const auto id = static_cast<size_t>(iterator);
  int64_t points = id < extents.size() ? extents[id] : points_of_fusion;
  for (int d = 0; d <= depth; ++d) {
    const Loop& loop = nest.loops[static_cast<size_t>(d)];
    const bool is_around = loop.iterator == iterator && !is_phase(nest, static_cast<size_t>(d));
    if (is_around) points = std::min(points, loop.step);
  }
  return points;
}

int64_t trips(const Cover& extents, const Nest& nest, size_t depth) {
  const Loop& loop = nest.loops[depth];
  if (is_phase(nest, depth)) return outer_step(nest, loop.iterator, loop.step) / loop.step;
  const int64_t points = points_inside(extents, nest, static_cast<int>(depth) - 1, loop.iterator);
  return (points + loop.step - 1) / loop.step;
}

bool fits(int64_t step, int64_t points) { return step == points || 2 * step <= points; }

bool has_same_order(const Nest& a, const Nest& b, const Cover& extents) {
  const auto order = [&](const Nest& nest) {  // neighbours of one iterator count as one
    std::vector<std::tuple<int16_t, int64_t, ForType>> loops;
    for (size_t d = 0; d < nest.loops.size(); ++d) {
      const Loop& loop = nest.loops[d];
      if (trips(extents, nest, d) == 1) continue;
      const bool is_next = !loops.empty() && std::get<0>(loops.back()) == loop.iterator &&
                           std::get<2>(loops.back()) == loop.kind;
      if (is_next) loops.pop_back();
      loops.emplace_back(loop.iterator, loop.step, loop.kind);
    }
    return loops;
  };
  return order(a) == order(b);
}

double bytes_of_element(const Context& context, const Access& access) {
  if (access.of < 0)
    return context.accesses.images()[static_cast<size_t>(access.image)]->type.bytes();
  return context.accesses.func(access.of).func->types[0].bytes();
}

int64_t operations(const Plan& plan, const Context& context, StageId stage) {
  return body_operations(plan, context, stage, {}, {});
}

int64_t body_operations(const Plan& plan, const Context& context, StageId stage, const Nest& nest,
                        const Cover& extents) {
  constexpr int64_t most = 2 * most_body_operations;  // no product overflows
  std::map<StageId, int64_t> known;                   // of one copy
  const auto copies = [&](IteratorSet depends) {
    int64_t product = 1;
    for (size_t d = 0; d < nest.loops.size() && product < most; ++d) {
      const int16_t iterator = nest.loops[d].iterator;
      const bool tells_apart =
          static_cast<size_t>(iterator) >= extents.size() || (set_of(iterator) & depends);
      if (nest.loops[d].kind == ForType::Unrolled && tells_apart)
        product *= trips(extents, nest, d);
    }
    return product;
  };
  const std::function<int64_t(StageId)> count = [&](StageId id) {
    if (const auto found = known.find(id); found != known.end()) return found->second;
    const StageNode& node = context.accesses.stage(id);
    int64_t sum = 1;
    const auto add = [&](int64_t operations, IteratorSet depends) {
      sum = std::min(sum + operations * (id == stage ? copies(depends) : 1), most);
    };
    for (const OperationCount& operation : node.operations) {
      const bool is_decided = id == stage && copies(operation.decided_by) > 1;
      if (!is_decided) add(operation.count, operation.depends);
    }
    for (const Access& read : node.reads) {
      if (read.of >= 0 && read.of != id.func && is_inlined(plan, read.of))
        add(count({read.of, 0}), read.moved_by());
    }
    return known[id] = sum;
  };
  return count(stage);
}

int64_t lanes_for(const Plan& plan, StageId stage, int64_t extent) {
  int bits = 0;
  for (const Type& type : plan.program->funcs[static_cast<size_t>(stage.func)]->types)
    bits = std::max(bits, type.bits());
  const int64_t full = std::clamp(schedule_lanes * 32 / bits, schedule_lanes, 4 * schedule_lanes);
  int64_t lanes = full;
  while (lanes > extent && 4 * lanes > full) lanes /= 2;
  return lanes <= extent && 4 * lanes >= full ? lanes : 1;
}

int lanes_together(const Context& context, StageId stage, int iterator) {
  const StageNode& node = context.accesses.stage(stage);
  int count = 0;
  const auto note = [&](const Access& access, int weight) {
    const LaneForm form =
        lane_form(access, iterator, schedule_lanes, context.sizes, {line_elements});
    if (form.kind == LaneForm::Kind::Contiguous) count += weight;
    if (form.kind == LaneForm::Kind::Strided || form.kind == LaneForm::Kind::Gather)
      count -= weight;
  };
  note(node.write, 2);
  for (const Access& read : node.reads) note(read, 1);
  return count;
}

// ---- changes ----

void insert_step(Nest& nest, int iterator, int64_t step, size_t depth, ForType kind) {
  Loop loop;
  loop.iterator = static_cast<int16_t>(iterator);
  loop.step = step;
  loop.kind = kind;
  nest.loops.insert(nest.loops.begin() + static_cast<std::ptrdiff_t>(depth), loop);
  set_tails(nest, iterator);
}

void drop_loop(Nest& nest, size_t depth) {
  const Loop dropped = nest.loops[depth];
  const int64_t larger = outer_step(nest, dropped.iterator, dropped.step);
  if (larger > 0) nest.loops[*find_loop(nest, dropped.iterator, larger)].step = dropped.step;
  nest.loops.erase(nest.loops.begin() + static_cast<std::ptrdiff_t>(depth));
  set_tails(nest, dropped.iterator);
}

std::optional<Nest> without_body(const Nest& nest, const Context& context, StageId stage) {
  Nest result = nest;
  for (size_t d = nest.loops.size(); d-- > body_depth(nest);) {
    Loop& loop = result.loops[d];
    const bool adds_up = is_reduction(context, stage, loop.iterator);
    const bool is_lane = loop.kind == ForType::Vectorized;
    if (adds_up && is_lane && nest.concurrency != Concurrency::Independent) return std::nullopt;
    loop.kind = ForType::Serial;
    if ((!adds_up || is_lane) && outer_step(result, loop.iterator, loop.step) > 0)
      drop_loop(result, d);
  }
  // Lanes outside of other loops would stay.
  return vector_loop(result) ? std::nullopt : std::optional(result);
}

void run_inside(Nest& nest, int iterator, int64_t points, ForType kind) {
  const size_t at = innermost_loop(nest, iterator);
  if (outer_step(nest, iterator, 1) == points) {  // its loop has just these points
    const auto loop = nest.loops.begin() + static_cast<std::ptrdiff_t>(at);
    std::rotate(loop, loop + 1, nest.loops.end());
    nest.loops.back().kind = kind;
  } else {
    nest.loops[at].step = points;
    insert_step(nest, iterator, 1, nest.loops.size(), kind);
  }
}

void run_along_rows(FuncPlan& changed, const Plan& plan, const Context& context, FuncId func,
                    const Cover& extents, int64_t min_lanes) {
  for (size_t s = 0; s < changed.nests.size(); ++s) {
    const StageId stage{func, static_cast<int16_t>(s)};
    const bool is_at_root = changed.placement.compute.kind == Level::Kind::Root;
    if (context.device && is_at_root && may_be_kernel(plan, context, stage)) {
      const KernelShape shape{context.device->warp_size};
      changed.nests[s] = kernel_loops(plan, context, stage, changed.storage.order, shape);
      continue;
    }
    changed.nests[s] = row_loops(plan, context, stage, changed.storage.order, extents, min_lanes);
    if (is_at_root && is_worth_a_launch(plan, context, stage))
      run_in_parallel(changed.nests[s], context, stage);
  }
}

void store_first(Storage& storage, int dimension) {
  const auto at = std::ranges::find(storage.order, dimension);
  std::rotate(storage.order.begin(), at, at + 1);
}

}  // namespace retrograde::planning::moves
