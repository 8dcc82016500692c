#include "autoschedule/scatter_slices.h"

#include <algorithm>
#include <optional>

#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/read_estimate.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int narrowest = 4;  // lanes over which the cost of a place is spread
constexpr int64_t least_slices =
    planning::reference_tasks;  // iterations of loops that run in parallel

// Who reads what, through what is computed inline: all reads of each Func that is not.
class Reads {
 public:
  Reads(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored) {
    for (const FuncPtr& f : topological_order(outputs)) {
      if (is_computed_inline(f, stored)) continue;
      for (int s = 0; s < f->stage_count(); ++s) {
        for (const Expr& root : roots_with_inlined(f->stage(s), stored)) note(f, root);
      }
      for (const FuncPtr& callee : direct_callees(*f)) {
        if (f->is_extern()) by_[callee.get()].push_back({f, Expr()});
      }
    }
  }

  struct Read {
    FuncPtr reader;
    Expr call;
  };
  const std::vector<Read>& of(const FuncContents& f) { return by_[&f]; }

 private:
  void note(const FuncPtr& reader, const Expr& root) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (call && call->call_type == CallType::Func && call->symbol.raw() != reader.get())
        by_[call->symbol.raw()].push_back({reader, e});
      return true;
    });
  }
  std::unordered_map<const Symbol*, std::vector<Read>> by_;
};

// The dimension of the reader that is index d of all reads, and of no other index of them.
std::optional<size_t> dimension_of(const FuncContents& reader,
                                   const std::vector<Reads::Read>& reads, size_t d) {
  std::optional<size_t> result;
  for (const Reads::Read& read : reads) {
    const auto& args = read.call.as<Call>()->args;
    for (size_t k = 0; k < reader.args.size(); ++k) {
      const std::string& var = reader.args[k];
      const auto moves = [&](const Expr& e) { return uses_variable(e, var); };
      if (!moves(args[d])) continue;
      const auto* index = unclamped(args[d], moves).as<Variable>();
      const bool is_alone = std::count_if(args.begin(), args.end(), moves) == 1;
      if (!index || index->name != var || !is_alone || result.value_or(k) != k) return std::nullopt;
      result = k;
    }
    if (!result) return std::nullopt;
  }
  return result;
}

bool may_be_reader(const FuncContents& f) {
  return !has_directives(f) && f.is_pure() && !f.is_extern() && f.args.size() > 1;
}

// The slices of a scatter whose dimensions `apart` have places of their own for each value.
std::optional<ScatterSlices> slices_of(const FuncPtr& scatter, ScatterLanes lanes,
                                       const std::vector<Reads::Read>& reads,
                                       const SizeEstimate& sizes) {
  const int64_t bytes = sizes.bytes(*scatter);
  if (bytes < sizes.machine().last_cache_bytes() || reads.empty()) return std::nullopt;
  const FuncPtr& reader = reads[0].reader;
  const bool is_only = std::all_of(reads.begin(), reads.end(),
                                   [&](const Reads::Read& r) { return r.reader == reader; });
  if (!is_only || !may_be_reader(*reader)) return std::nullopt;
  const int64_t extent = *sizes.extent(*scatter, lanes.dimension);
  int64_t apart_slices = 1;
  ScatterSlices slices{scatter, reader, lanes};
  for (const size_t d : dimensions_apart(*scatter, lanes)) {
    const auto k = dimension_of(*reader, reads, d);
    if (!k || *k == 0) return std::nullopt;
    slices.apart.push_back(*k);
    apart_slices *= *sizes.extent(*scatter, d);
  }
  const auto k = dimension_of(*reader, reads, lanes.dimension);
  if (!k || *k == 0) return std::nullopt;
  slices.dimension = *k;
  int& width = slices.lanes.width;
  while (width > narrowest && bytes / apart_slices / extent * width > planning::second_cache_bytes)
    width /= 2;
  const int64_t count = (extent + width - 1) / width * apart_slices;
  return count >= least_slices ? std::optional(std::move(slices)) : std::nullopt;
}

}  // namespace

SlicedScatters::SlicedScatters(const std::vector<FuncPtr>& outputs,
                               const std::vector<FuncPtr>& stored,
                               const std::unordered_set<const Symbol*>& but,
                               const SizeEstimate& sizes) {
  std::optional<Reads> reads;
  for (const FuncPtr& f : stored) {
    const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    const auto lanes = has_directives(*f) || is_output || but.contains(f.get())
                           ? std::nullopt
                           : scatter_lanes(*f, sizes);
    if (!lanes) continue;
    if (!reads) reads.emplace(outputs, stored);
    auto slices = slices_of(f, *lanes, reads->of(*f), sizes);
    if (!slices || but.contains(slices->reader.get())) continue;
    if (std::find(stored.begin(), stored.end(), slices->reader) == stored.end()) continue;
    if (!by_reader_.emplace(slices->reader.get(), all_.size()).second) continue;
    by_scatter_.emplace(f.get(), all_.size());
    all_.push_back(*std::move(slices));
  }
}

void schedule_slices(const ScatterSlices& slices) {
  const FuncPtr& f = slices.reader;
  const auto is_outside = [&](size_t d) {
    return d == slices.dimension ||
           std::find(slices.apart.begin(), slices.apart.end(), d) != slices.apart.end();
  };
  Stage stage(f, 0);
  const Var x(f->args[0]), lanes(f->args[slices.dimension]);
  const Var in_row(inner_loop(*f, 0, x.name()));
  stage.split(x, x, in_row, planning::schedule_lanes, TailStrategy::GuardWithIf);
  const Var in_slice(inner_loop(*f, 0, lanes.name()));
  stage.split(lanes, lanes, in_slice, slices.lanes.width, TailStrategy::GuardWithIf);
  std::vector<VarOrRVar> order{in_row, in_slice};
  for (size_t d = 0; d < f->args.size(); ++d) {
    if (!is_outside(d)) order.push_back(Var(f->args[d]));
  }
  order.push_back(lanes);
  for (const size_t d : slices.apart) order.push_back(Var(f->args[d]));
  stage.reorder(order).vectorize(in_row).parallel(lanes);
  if (slices.lanes.width == narrowest) stage.unroll(in_slice);
  for (const size_t d : slices.apart) stage.parallel(Var(f->args[d]));
  Func(slices.scatter).compute_at(Func(f), lanes);
}

}  // namespace retrograde::autoschedule
