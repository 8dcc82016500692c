#include "autoschedule/cut_reductions.h"

#include <algorithm>
#include <utility>

#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/stored_funcs.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int terms = 256;  // that a lane adds up, where there is one dimension
constexpr int groups = planning::privatised_copies;        // of rows, summed apart before all are
constexpr int64_t long_sum = 4096;                         // iterations
constexpr int64_t short_loop = planning::reference_tasks;  // fewer iterations make no tasks
constexpr int64_t few_elements =
    planning::schedule_lanes;  // fewer than fill the lanes and the threads of a machine
constexpr int64_t unknown_extent = 1024;

int64_t extent_of(const ReductionVariable& r) {
  return as_const_int(simplify(r.extent)).value_or(unknown_extent);
}

// Elements that the pure loops of an update run over; nothing where they may be many, or places are
// other than pure variables and constants.
std::optional<int64_t> elements_of(const FuncContents& f, const Definition& update,
                                   const SizeEstimate& sizes) {
  int64_t elements = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (is_const(update.args[d])) continue;
    const auto extent =
        is_pure_position(f, update, d) ? sizes.extent(f, d) : std::optional<int64_t>();
    if (!extent || *extent > few_elements) return std::nullopt;
    elements *= *extent;
  }
  return elements;
}

// Whether the update adds much to few elements, and may do so in another order.
bool is_long_sum(const FuncContents& f, const Definition& update, const SizeEstimate& sizes) {
  double iterations = update.rvars.empty() ? 0 : 1;
  for (const ReductionVariable& r : update.rvars) iterations *= static_cast<double>(extent_of(r));
  if (iterations < long_sum || elements_of(f, update, sizes).value_or(INT64_MAX) > few_elements)
    return false;
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

// Partial results of the update for each value of two of its loops, of which the first is lanes.
FuncPtr factor(Stage update, const RVar& lane, const RVar& row) {
  const FuncContents& f = *update.function();
  const Var u(new_loop(f, update.index(), "lanes")), v(new_loop(f, update.index(), "parts"));
  Func parts = update.rfactor({{lane, u}, {row, v}});
  std::vector<VarOrRVar> order{u};
  for (const VarOrRVar& loop : parts.update().split_vars()) {
    if (loop.name() != u.name() && loop.name() != v.name()) order.push_back(loop);
  }
  order.push_back(v);
  std::vector<Var> layout{u};  // lanes lie together
  for (const Var& arg : parts.args()) {
    if (arg.name() != u.name()) layout.push_back(arg);
  }
  parts.compute_root().parallel(v);
  parts.reorder(std::vector<VarOrRVar>(layout.begin(), layout.end()));
  if (layout.size() > 2) parts.reorder_storage(layout);
  vectorize(Stage(parts.function(), 0), u, planning::schedule_lanes, TailStrategy::Auto);
  parts.update().reorder(order).parallel(v);
  vectorize(parts.update(), u, planning::schedule_lanes, TailStrategy::GuardWithIf);
  return parts.function();
}

// Of the reduction variables, by number: that which is cut into lanes, and that whose iterations are
// tasks; the same where no other is long.
struct Cut {
  size_t lanes = 0, rows = 0;
};

Cut cut_of(const std::vector<ReductionVariable>& rvars) {
  Cut cut;
  while (cut.lanes + 1 < rvars.size() && extent_of(rvars[cut.lanes]) < planning::schedule_lanes)
    ++cut.lanes;
  cut.rows = cut.lanes;
  for (size_t i = 0; i < rvars.size(); ++i) {
    const bool is_longer =
        cut.rows == cut.lanes || extent_of(rvars[i]) > extent_of(rvars[cut.rows]);
    if (i != cut.lanes && is_longer && extent_of(rvars[i]) >= short_loop) cut.rows = i;
  }
  return cut;
}

// The sums of each iteration of the loop of tasks, or of each block of a single loop.
FuncPtr cut(const FuncPtr& f, int stage) {
  const std::vector<ReductionVariable> rvars = f->stage(stage).rvars;
  const auto [lanes, rows] = cut_of(rvars);
  Stage update(f, stage);
  const RVar all(rvars[lanes].var), lane(new_loop(*f, stage, "lane")),
      group(new_loop(*f, stage, "group"));
  RVar row(rvars[rows].var);
  if (rows == lanes) {
    row = RVar(new_loop(*f, stage, "block"));
    update.split(all, row, all, planning::schedule_lanes * terms, TailStrategy::GuardWithIf);
    update.split(all, all, lane, planning::schedule_lanes);
  } else {
    update.split(all, all, lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
  }
  const FuncPtr sums = factor(update, lane, row);
  update.split(row, row, group, groups, TailStrategy::GuardWithIf);
  factor(update, lane, group);
  if (f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined) Func(f).compute_root();
  return sums;
}

// Elements of a vector or a small matrix are added up together, in registers: they share what their terms read.
//
//   for k, j: for r: parts(k, j) += w(r) * p(k, r) * q(j, r)   =>   for r: for k, j, unrolled: parts(k, j) += ...
void add_elements_together(const FuncPtr& sums, const FuncContents& f,
                           const planning::Machine& machine, const SizeEstimate& sizes) {
  Stage update(sums, 1);
  const std::vector<Dim> loops = sums->updates.at(0).schedule.dims;
  std::vector<VarOrRVar> copies;
  int64_t bytes = planning::schedule_lanes * graph::total_bytes(f.types);
  for (size_t d = 0; d < f.args.size(); ++d) {
    const Var all(f.args[d]);
    const auto extent = sizes.extent(f, d);
    const bool is_loop =
        std::ranges::any_of(loops, [&](const Dim& loop) { return loop.var == all.name(); });
    if (!is_loop || !extent || *extent < 2 || bytes * *extent > machine.accumulator_bytes())
      continue;
    bytes *= *extent;
    const Var copy(inner_loop(*sums, 1, all.name()));
    update.split(all, all, copy, static_cast<int>(*extent), TailStrategy::GuardWithIf).unroll(copy);
    copies.emplace_back(copy);
  }
  if (copies.empty()) return;
  std::vector<VarOrRVar> order{VarOrRVar(loops[0].var, loops[0].is_reduction)};
  order.insert(order.end(), copies.begin(), copies.end());
  for (size_t i = 1; i < loops.size(); ++i) order.emplace_back(loops[i].var, loops[i].is_reduction);
  update.reorder(order);
}

}  // namespace

std::optional<std::string> rows_of_sum(const FuncPtr& f, int stage, const SizeEstimate& sizes) {
  const Definition& update = f->stage(stage);
  if (stage == 0 || !is_long_sum(*f, update, sizes)) return std::nullopt;
  const auto [lanes, rows] = cut_of(update.rvars);
  if (rows == lanes) return std::nullopt;
  return update.rvars[rows].var;
}

FuncPtr sum_rows(const FuncPtr& f, int stage) { return cut(f, stage); }

void cut_reductions(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                    const planning::Machine& machine,
                    const std::unordered_set<const Symbol*>& but) {
  for (const FuncPtr& f : topological_order(outputs)) {
    if (has_directives(*f) || f->is_extern() || but.contains(f.get())) continue;
    for (int s = 1; s < f->stage_count(); ++s) {
      if (is_long_sum(*f, f->stage(s), sizes)) add_elements_together(cut(f, s), *f, machine, sizes);
    }
  }
}

}  // namespace retrograde::autoschedule
