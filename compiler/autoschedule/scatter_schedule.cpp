#include "autoschedule/scatter_schedule.h"

#include <algorithm>
#include <utility>

#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t least_lanes = 4;  // of a dimension that is worth vectors
constexpr int64_t few_values = 4;   // iterations that are unrolled

// Of a dimension of so many elements.
int lanes_for(int64_t extent) {
  int width = planning::schedule_lanes;
  while (width > std::max<int64_t>(extent, 1)) width /= 2;
  return width;
}

bool adds_to_itself(const FuncContents& f, const Definition& update) {
  return !point_number(update) &&
         std::all_of(update.values.begin(), update.values.end(), [&](const Expr& value) {
           const auto* sum = value.as<Add>();
           return sum && is_old_value(sum->a, f, update) && !calls(sum->b, &f);
         });
}

bool scatters(const FuncContents& f, const Definition& update) {
  return !update.rvars.empty() && adds_to_itself(f, update) &&
         std::any_of(update.args.begin(), update.args.end(),
                     [](const Expr& place) { return reads_memory(place, MemoryReads::Functions); });
}

bool is_part(const FuncContents& f, size_t d) {
  return f.made && f.made->has_parts && d + 1 == f.args.size();
}

// Whether the value of a loop variable picks one of a few places to write to.
bool is_tap(const Definition& update, const ReductionVariable& r) {
  const auto extent = as_const_int(r.extent);
  if (!extent || *extent > most_taps) return false;
  return std::any_of(update.args.begin(), update.args.end(), [&](const Expr& place) {
    return any_node(place, [&](const Expr& e) {
      const auto* is = e.as<EQ>();
      const auto* picks = is ? is->a.as<Variable>() : nullptr;
      return picks && picks->name == r.var && is_const(is->b);
    });
  });
}

// Those that are taps, or those that are none, in their order.
std::vector<VarOrRVar> loops_of(const Definition& update, bool taps) {
  std::vector<VarOrRVar> loops;
  for (const ReductionVariable& r : update.rvars) {
    if (!r.numbers_points && is_tap(update, r) == taps) loops.push_back(RVar(r.var));
  }
  return loops;
}

void append(std::vector<VarOrRVar>& loops, const std::vector<VarOrRVar>& more) {
  loops.insert(loops.end(), more.begin(), more.end());
}

// ---- lanes of independent elements ----

bool is_independent(const FuncContents& f, size_t d) {
  return std::all_of(f.updates.begin(), f.updates.end(),
                     [&](const Definition& update) { return is_pure_position(f, update, d); });
}

// Whether a place is another one for another value of the independent dimension.
bool moves_places(const FuncContents& f, size_t d) {
  return is_part(f, d) ||
         std::any_of(f.updates.begin(), f.updates.end(), [&](const Definition& update) {
           for (size_t i = 0; i < f.args.size(); ++i) {
             if (i != d && uses_variable(update.args[i], f.args[d])) return true;
           }
           return false;
         });
}

// Dimensions by what they are to a scatter.
struct Roles {
  std::vector<size_t> independent;  // of its places: that of the lanes first
  std::vector<size_t> scattered;
  std::vector<size_t> apart;  // each value has places of its own
};

Roles roles_of(const FuncContents& f, size_t lanes) {
  Roles roles{{lanes}, {}, {}};
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (d == lanes) continue;
    if (!is_independent(f, d))
      roles.scattered.push_back(d);
    else
      (moves_places(f, d) ? roles.apart : roles.independent).push_back(d);
  }
  return roles;
}

// Elements in the order of memory, in parallel over the last dimension.
void schedule_zeros(const FuncPtr& f, const std::vector<Var>& dims, int width, bool in_slices) {
  Stage zeros(f, 0);
  zeros.reorder(std::vector<VarOrRVar>(dims.begin(), dims.end()));
  if (!in_slices) zeros.parallel(dims.back());
  vectorize(zeros, dims[0], width, TailStrategy::GuardWithIf);
}

void schedule_update(const FuncPtr& f, int s, const Roles& roles, int width, bool in_slices,
                     const SizeEstimate& sizes) {
  const Definition& update = f->stage(s);
  Stage stage(f, s);
  std::vector<VarOrRVar> inner, outer;
  for (const size_t d : roles.independent) {
    const int64_t extent = sizes.extent(*f, d).value_or(0);
    const bool is_lanes = inner.empty(), is_short = extent > 1 && extent <= few_values;
    const Var all(f->args[d]);
    outer.push_back(all);
    if (!is_lanes && !is_short) continue;
    const Var part(inner_loop(*f, s, all.name()));
    stage.split(all, all, part, is_lanes ? width : static_cast<int>(extent),
                TailStrategy::GuardWithIf);
    inner.push_back(part);
  }
  for (const size_t d : roles.apart) outer.push_back(Var(f->args[d]));
  const std::vector<VarOrRVar> taps = loops_of(update, true);
  std::vector<VarOrRVar> order = inner;
  append(order, taps);
  append(order, loops_of(update, false));
  append(order, outer);
  stage.reorder(order).vectorize(inner[0]);
  for (size_t i = 1; i < inner.size(); ++i) stage.unroll(inner[i]);
  for (const VarOrRVar& tap : taps) stage.unroll(tap);
  if (in_slices) return;
  for (const VarOrRVar& loop : outer) stage.parallel(loop);
}

}  // namespace

std::optional<ScatterLanes> scatter_lanes(const FuncContents& f, const SizeEstimate& sizes) {
  if (f.is_extern() || (f.made && f.made->lanes > 0)) return {};
  if (!std::any_of(f.updates.begin(), f.updates.end(),
                   [&](const Definition& update) { return scatters(f, update); }))
    return {};
  int64_t most = 0;
  size_t lanes = 0;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const int64_t extent = sizes.extent(f, d).value_or(0);
    if (!is_independent(f, d) || moves_places(f, d) || extent <= most) continue;
    most = extent;
    lanes = d;
  }
  if (most < least_lanes) return {};
  return ScatterLanes{lanes, lanes_for(most)};
}

std::vector<size_t> dimensions_apart(const FuncContents& f, const ScatterLanes& lanes) {
  return roles_of(f, lanes.dimension).apart;
}

void schedule_scatter_lanes(const FuncPtr& f, const ScatterLanes& lanes, const SizeEstimate& sizes,
                            bool in_slices) {
  const Roles roles = roles_of(*f, lanes.dimension);
  std::vector<Var> dims;
  for (const std::vector<size_t>& some : {roles.independent, roles.scattered, roles.apart}) {
    for (const size_t d : some) dims.push_back(Var(f->args[d]));
  }
  Func(f).reorder_storage(dims);
  schedule_zeros(f, dims, lanes.width, in_slices);
  for (int s = 1; s < f->stage_count(); ++s)
    schedule_update(f, s, roles, lanes.width, in_slices, sizes);
}

bool is_scatter(const FuncContents& f, const Definition& update) { return scatters(f, update); }
std::vector<VarOrRVar> loops_of_taps(const Definition& update) { return loops_of(update, true); }
std::vector<VarOrRVar> loops_but_taps(const Definition& update) { return loops_of(update, false); }

// ---- sums of parts ----

FuncPtr parts_of_sum(const FuncContents& f, const Definition& update) {
  if (update.predicate.defined() || update.rvars.size() != 1) return nullptr;
  FuncPtr parts;
  for (const Expr& value : update.values) {
    const auto* sum = value.as<Add>();
    const auto* call = sum && is_old_value(sum->a, f, update) ? sum->b.as<Call>() : nullptr;
    parts = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
    const bool has_parts = parts && parts->made && parts->made->has_parts &&
                           parts->made->lanes == 0 && call->args.size() == f.args.size() + 1;
    if (!has_parts) return nullptr;
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (!is_pure_position(f, update, d) || !equal(call->args[d], update.args[d])) return nullptr;
    }
  }
  return parts;
}

namespace {

// Dimensions, innermost first; empty where they lie as they stand.
std::vector<size_t> storage_order(const FuncContents& f) {
  std::vector<size_t> order;
  for (const std::string& dim : f.schedule.storage_dims) {
    const auto found = std::find(f.args.begin(), f.args.end(), dim);
    order.push_back(static_cast<size_t>(found - f.args.begin()));
  }
  return std::is_sorted(order.begin(), order.end()) ? std::vector<size_t>() : order;
}

}  // namespace

std::optional<std::vector<size_t>> layout_of_parts(const FuncContents& f) {
  std::optional<std::vector<size_t>> layout;
  for (const Definition& update : f.updates) {
    const FuncPtr parts = parts_of_sum(f, update);
    std::vector<size_t> order = parts ? storage_order(*parts) : std::vector<size_t>();
    if (order.empty() || order.back() != f.args.size()) return std::nullopt;
    order.pop_back();
    if (layout && *layout != order) return std::nullopt;
    layout = order;
  }
  return layout;
}

void schedule_sum_of_parts(const FuncPtr& f, const std::vector<size_t>& layout,
                           const SizeEstimate& sizes) {
  std::vector<Var> dims;
  for (const size_t d : layout) dims.push_back(Var(f->args[d]));
  const int width = lanes_for(sizes.extent(*f, layout[0]).value_or(planning::schedule_lanes));
  Func(f).reorder_storage(dims);
  for (int s = 0; s < f->stage_count(); ++s) {
    Stage stage(f, s);
    std::vector<VarOrRVar> order(dims.begin(), dims.end());
    if (s > 0) order.insert(order.begin() + 1, RVar(f->stage(s).rvars[0].var));
    stage.reorder(order).parallel(dims.back());
    vectorize(stage, dims[0], width, TailStrategy::GuardWithIf);
  }
}

// ---- vectors of iterations ----

namespace {

// The loop whose iterations fill vectors: the first long one, unless too many iterations lie inside of it.
const ReductionVariable* loop_of_lanes(const Definition& update) {
  int64_t inside = 1;
  for (const ReductionVariable& r : update.rvars) {
    if (r.numbers_points || is_tap(update, r)) continue;
    const auto extent = as_const_int(r.extent);
    if (!extent || *extent >= planning::schedule_lanes) return inside <= few_values ? &r : nullptr;
    inside *= std::max<int64_t>(*extent, 1);
  }
  return nullptr;
}

}  // namespace

bool scatters_in_order(const FuncContents& f, const Definition& stage) {
  return !stage.args.empty() && loop_of_lanes(stage) && !is_pure_position(f, stage, 0) &&
         scatters(f, stage);
}

void schedule_scatter_in_order(const FuncContents& f, int index, Stage& stage) {
  const Definition& update = f.stage(index);
  const RVar all(loop_of_lanes(update)->var), lane(inner_loop(f, index, all.name()));
  std::vector<VarOrRVar> inside = loops_of(update, true), outside = loops_of(update, false);
  const auto first = std::find_if(outside.begin(), outside.end(),
                                  [&](const VarOrRVar& loop) { return loop.name() == all.name(); });
  inside.insert(inside.begin(), outside.begin(), first);  // short ones
  outside.erase(outside.begin(), first);
  std::vector<VarOrRVar> order{lane};
  append(order, inside);
  append(order, outside);
  stage.allow_race_conditions()
      .split(all, all, lane, planning::schedule_lanes, TailStrategy::GuardWithIf)
      .reorder(order)
      .vectorize(lane);
  for (const VarOrRVar& loop : inside) stage.unroll(loop);
}

void unroll_taps(const Definition& update, Stage& stage) {
  for (const VarOrRVar& tap : loops_of(update, true)) stage.unroll(tap);
}

}  // namespace retrograde::autoschedule
