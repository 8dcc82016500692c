#include "testing/interpreter/func_values.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/lists.h"

namespace retrograde::oracle {

using namespace graph;

namespace {

Point pick(const Point& point, const std::vector<int>& dims) {
  Point result;
  for (const int d : dims) result.push_back(point[d]);
  return result;
}

}  // namespace

std::vector<Array> FuncValues::realize(const FuncContents& func, const Region& region) {
  FuncState& state = state_of(func);
  std::vector<Array> result;
  for (const Type& type : func.types)
    result.push_back({expressions_.widened(type), region, std::vector<Value>(region.points())});
  size_t index = 0;
  region.for_each([&](const Point& point) {
    for (size_t v = 0; v < result.size(); ++v) {
      result[v].values[index] = read(state, point, static_cast<int>(v));
    }
    ++index;
  });
  return result;
}

FuncValues::FuncState& FuncValues::state_of(const FuncContents& func) {
  auto& state = states_[&func];
  if (!state) {
    if (!func.is_defined()) {
      user_error("interpret " + quoted(func.name), "a Func needs a pure definition first");
    }
    state = make_state(func);
  }
  return *state;
}

std::unique_ptr<FuncValues::FuncState> FuncValues::make_state(const FuncContents& func) {
  if (func.is_extern()) {
    unsupported("interpret " + quoted(func.name), "a Func is evaluated by its definitions",
                "the C function " + quoted(func.extern_definition->function) + " computes it",
                "Interpret a Func that does not depend on it");
  }
  auto state = std::make_unique<FuncState>();
  state->func = &func;
  for (int s = 0; s < func.stage_count(); ++s) state->stages.push_back(frame_of(func, s));
  for (int d = 0; d < func.dimensions(); ++d) {
    const bool pure =
        std::ranges::all_of(state->stages, [&](const Frame& f) { return f.is_pure_arg[d]; });
    (pure ? state->pure_dims : state->scattered_dims).push_back(d);
  }
  return state;
}

// ---- reads ----

Value FuncValues::read(const FuncContents& func, const Point& point, int component) {
  return read(state_of(func), point, component);
}

Value FuncValues::read(FuncState& f, const Point& point, int component) {
  if (f.func->is_pure()) return pure_values(f, point)[component];
  const Point slice = pick(point, f.pure_dims);
  const Point place = pick(point, f.scattered_dims);
  if (f.active) return read_self(f, point, slice, place, component);
  Island& island = island_at(f, slice, place);
  const Value value = cell(f, island, point, place)[component];
  return island.poisoned ? Value::unstable(value.scalar) : value;
}

const std::vector<Value>& FuncValues::pure_values(FuncState& f, const Point& point) {
  if (const auto* it = ir::find_or_null(f.memo, point)) return *it;
  std::vector<Value> values = evaluate_pure(f, point);
  check_size(f, f.memo.size());
  return f.memo.emplace(point, std::move(values)).first->second;
}

std::vector<Value> FuncValues::evaluate_pure(FuncState& f, const Point& point) {
  Frame& frame = f.stages[0];
  std::ranges::copy(point, frame.point.begin());
  ++frame.epoch;
  return expressions_.all_of(frame, frame.definition.values);
}

void FuncValues::check_size(const FuncState& f, size_t points) const {
  if (points >= options_.max_points) {
    call_error("interpret " + quoted(f.func->name),
               "a Func is evaluated at a bounded number of points",
               text("more than ", options_.max_points), "Raise InterpreterOptions::max_points.");
  }
}

// ---- islands ----

// The cells of a point inside of the island's box.
Value* FuncValues::cell(FuncState& f, Island& island, const Point& point, const Point& place) {
  size_t index = 0, stride = 1;
  for (size_t d = 0; d < place.size(); ++d) {
    index += (place[d] - island.box.mins[d]) * stride;
    stride *= island.box.extents[d];
  }
  Value* values = &island.cells[index * f.func->types.size()];
  if (!island.written[index]) {
    island.written[index] = true;
    const std::vector<Value> initial = evaluate_pure(f, point);
    std::ranges::copy(initial, values);
  }
  return values;
}

Value FuncValues::read_self(FuncState& f, const Point& point, const Point& slice,
                            const Point& place, int component) {
  if (slice != f.active_slice) {
    internal_error(quoted(f.func->name) + " reads itself at " + to_string(point) +
                   ", across a dimension that is pure in all of its definitions");
  }
  f.active->reached.include(place);
  if (!is_inside(f.active->box, place)) return evaluate_pure(f, point)[component];
  return cell(f, *f.active, point, place)[component];
}

FuncValues::Island& FuncValues::island_at(FuncState& f, const Point& slice, const Point& place) {
  auto& islands = f.slices[slice];
  for (auto& island : islands) {
    if (is_inside(island->box, place)) return *island;
  }
  // Later islands need not hold the stores: they lie outside of the points that the stores access.
  auto island = std::make_unique<Island>();
  island->grows_on_store = islands.empty();
  compute(f, slice, place, *island);
  islands.push_back(std::move(island));
  return *islands.back();
}

void FuncValues::compute(FuncState& f, const Point& slice, const Point& place, Island& island) {
  Hull hull;
  hull.include(place);
  do {
    hull.include(island.reached);
    island.box = hull.region();
    const size_t points = island.box.points();
    check_size(f, points);
    island.cells.assign(points * f.func->types.size(), Value());
    island.written.assign(points, false);
    f.active = &island;
    f.active_slice = slice;
    for (size_t s = 1; s < f.stages.size(); ++s) run_update(f, f.stages[s], island);
    f.active = nullptr;
  } while (!hull.contains(island.reached));
}

// ---- updates ----

void FuncValues::run_update(FuncState& f, Frame& frame, Island& island) {
  std::ranges::fill(frame.point, 0);
  for (size_t i = 0; i < f.pure_dims.size(); ++i) frame.point[f.pure_dims[i]] = f.active_slice[i];
  Region loops;                // the reduction domain, then the stage's pure dimensions
  std::vector<int> positions;  // in frame.point
  add_reduction_loops(f, frame, loops, positions);
  for (size_t i = 0; i < f.scattered_dims.size(); ++i) {
    if (!frame.is_pure_arg[f.scattered_dims[i]]) continue;
    loops.mins.push_back(island.box.mins[i]);
    loops.extents.push_back(island.box.extents[i]);
    positions.push_back(f.scattered_dims[i]);
  }
  loops.for_each([&](const Point& at) {
    for (size_t i = 0; i < at.size(); ++i) frame.point[positions[i]] = at[i];
    update_points(f, frame, island);
  });
}

void FuncValues::add_reduction_loops(FuncState& f, Frame& frame, Region& loops,
                                     std::vector<int>& positions) {
  ++frame.epoch;
  int position = f.func->dimensions();
  for (const auto& rvar : frame.definition.rvars) {
    if (rvar.numbers_points) continue;
    loops.mins.push_back(static_cast<int>(expressions_.get(frame, rvar.min).scalar.i));
    loops.extents.push_back(static_cast<int>(expressions_.get(frame, rvar.extent).scalar.i));
    positions.push_back(position++);
  }
}

// Computes all points of an iteration before the first is stored.
void FuncValues::update_points(FuncState& f, Frame& frame, Island& island) {
  const ReductionVariable* number = point_number(frame.definition);
  std::vector<Store> all;
  for (int i = 0; i < number_of_points(frame.definition); ++i) {
    if (number) frame.point.back() = i;
    ++frame.epoch;
    if (auto update = update_at(frame, island)) all.push_back(std::move(*update));
  }
  for (const Store& update : all) store(f, island, update);
}

std::optional<FuncValues::Store> FuncValues::update_at(Frame& frame, Island& island) {
  Store result;
  if (frame.definition.predicate.defined()) {
    const Value& condition = expressions_.get(frame, frame.definition.predicate);
    result.unsure = !condition.is_stable();
    if (!result.unsure && !condition.scalar.as_bool()) return std::nullopt;
  }
  result.values = expressions_.all_of(frame, frame.definition.values);
  bool stable = true;
  result.point = expressions_.coordinates(frame, frame.definition.args, stable);
  if (!stable) island.poisoned = true;
  return result;
}

void FuncValues::store(FuncState& f, Island& island, const Store& update) {
  const std::vector<Value>& values = update.values;
  if (std::ranges::all_of(values, [](const Value& v) { return v.is_undef(); })) return;
  const Point place = pick(update.point, f.scattered_dims);
  if (island.grows_on_store) island.reached.include(place);
  if (!is_inside(island.box, place)) return;
  Value* cells = cell(f, island, update.point, place);
  for (size_t v = 0; v < values.size(); ++v) {
    if (values[v].is_undef()) continue;
    cells[v] = update.unsure ? Value::unstable(values[v].scalar) : values[v];
  }
}

}  // namespace retrograde::oracle
