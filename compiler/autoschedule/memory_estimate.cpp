#include "autoschedule/memory_estimate.h"

#include <algorithm>
#include <set>
#include <string>
#include <unordered_map>

#include "graph/computing_order.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

using LevelKind = graph::LoopLevel::Kind;

bool is_inlined(const FuncContents& f, bool is_output) {
  return !is_output && f.is_pure() && f.schedule.compute_level.kind == LevelKind::Inlined;
}

// When each Func that is not inlined is computed and read last, as places in the order of lowering.
class Lives {
 public:
  explicit Lives(const std::vector<FuncPtr>& outputs) {
    find_computed(outputs);
    put_in_order();
    last_.resize(order_.size());
    for (size_t i = 0; i < order_.size(); ++i) {
      const size_t at = nest(i);
      last_[i] = std::max(last_[i], at);
      for (const size_t callee : computed_[number_[i]].callees) {
        size_t& last = last_[place_[callee]];
        last = std::max(last, at);
      }
    }
  }

  const std::vector<FuncPtr>& order() const { return order_; }
  bool is_output(size_t i) const { return computed_[number_[i]].is_output; }
  size_t last(size_t i) const { return last_[i]; }
  // The Func at root in whose loops one is stored: itself, or another.
  size_t nest(size_t i) const {
    for (size_t steps = 0; steps < order_.size(); ++steps) {
      const graph::LoopLevel& level = order_[i]->schedule.compute_level;
      const auto host = by_name_.find(level.func);
      if (level.kind != LevelKind::At || host == by_name_.end()) break;
      i = host->second;
    }
    return i;
  }
  const FuncContents* host_of(const FuncContents& f) const {
    const graph::LoopLevel& level = f.schedule.compute_level;
    const auto host = by_name_.find(level.func);
    return level.kind == LevelKind::At && host != by_name_.end() ? order_[host->second].get()
                                                                 : nullptr;
  }

 private:
  // What is not inlined, and what each reads of that, directly or through what is.
  void find_computed(const std::vector<FuncPtr>& outputs) {
    std::unordered_map<const FuncContents*, std::set<size_t>> reads;
    for (const FuncPtr& f : topological_order(outputs)) {
      std::set<size_t>& own = reads[f.get()];
      for (const FuncPtr& callee : direct_callees(*f)) {
        const auto& further = reads[callee.get()];
        own.insert(further.begin(), further.end());
      }
      const bool is_output = std::ranges::find(outputs, f) != outputs.end();
      if (is_inlined(*f, is_output)) continue;
      computed_.push_back({{own.begin(), own.end()}, {}, f->args.size(), is_output});
      own = {funcs_.size()};
      by_name_[f->name] = funcs_.size();
      funcs_.push_back(f);
    }
    for (size_t f = 0; f < funcs_.size(); ++f) {
      const graph::LoopLevel& level = funcs_[f]->schedule.compute_level;
      const auto host = by_name_.find(level.func);
      if (level.kind == LevelKind::At && host != by_name_.end()) computed_[f].host = host->second;
    }
  }
  void put_in_order() {
    number_ = graph::computing_order(computed_);
    place_.resize(number_.size());
    for (size_t i = 0; i < number_.size(); ++i) {
      place_[number_[i]] = i;
      order_.push_back(funcs_[number_[i]]);
      by_name_[order_.back()->name] = i;
    }
  }

  std::vector<FuncPtr> funcs_;                 // producers before consumers
  std::vector<graph::ComputedFunc> computed_;  // of each of them
  std::vector<size_t> number_, place_;         // of each place: the Func's; and back
  std::vector<FuncPtr> order_;
  std::unordered_map<std::string, size_t> by_name_;
  std::vector<size_t> last_;
};

// Iterations of the loops of a stage from the outermost to `var`, of those over the Func's own
// variables; those that were split count by their factors.
double iterations_around(const FuncContents& f, const Definition& stage, const std::string& var,
                         const SizeEstimate& sizes) {
  std::unordered_map<std::string, double> extents;
  for (size_t d = 0; d < f.args.size(); ++d)
    extents[f.args[d]] = static_cast<double>(sizes.extent(f, d).value_or(1));
  for (const ReductionVariable& r : stage.rvars)
    extents[r.var] = static_cast<double>(as_const_int(r.extent).value_or(1));
  for (const Split& split : stage.schedule.splits) {
    const auto factor =
        split.kind == Split::Kind::Split ? as_const_int(split.factor) : std::nullopt;
    const double all = extents[split.old_var];
    const double inner = std::min(all, factor ? static_cast<double>(*factor) : 1.0);
    extents[split.inner] = inner;
    extents[split.outer] = inner > 0 ? std::max(1.0, all / inner) : 1;
  }
  double iterations = 1;
  const auto& loops = stage.schedule.dims;
  for (auto loop = loops.rbegin(); loop != loops.rend(); ++loop) {
    iterations *= std::max(1.0, extents[loop->var]);
    if (loop->var == var) return iterations;
  }
  return 1;
}

// Of one slice for each thread.
int64_t bytes_of(const FuncContents& f, const Lives& lives, const SizeEstimate& sizes,
                 int64_t threads) {
  const int64_t all = sizes.bytes(f);
  const FuncContents* host = lives.host_of(f);
  if (!host) return all;
  const graph::LoopLevel& level = f.schedule.store_level.kind == LevelKind::At
                                      ? f.schedule.store_level
                                      : f.schedule.compute_level;
  double iterations = 1;
  for (int s = 0; s < host->stage_count(); ++s)
    iterations = std::max(iterations, iterations_around(*host, host->stage(s), level.var, sizes));
  return std::min(all, static_cast<int64_t>(static_cast<double>(all) / iterations) * threads);
}

}  // namespace

MemoryEstimate estimate_memory(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                               int64_t threads) {
  const Lives lives(outputs);
  const std::vector<FuncPtr>& order = lives.order();
  struct Life {
    size_t first, last;
    MemoryEstimate::Part part;
  };
  std::vector<Life> all;
  std::vector<int64_t> change(order.size() + 1);
  for (size_t i = 0; i < order.size(); ++i) {
    if (lives.is_output(i)) continue;
    const size_t first = lives.nest(i), last = std::max(first, lives.last(i));
    const int64_t bytes = bytes_of(*order[i], lives, sizes, threads);
    all.push_back({first, last, {order[i], bytes}});
    change[first] += bytes;
    if (last + 1 < change.size()) change[last + 1] -= bytes;
  }
  MemoryEstimate result;
  size_t when = 0;
  int64_t alive = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    alive += change[i];
    if (alive > result.peak_bytes) {
      result.peak_bytes = alive;
      when = i;
    }
  }
  for (const Life& life : all) {
    if (life.first <= when && when <= life.last && life.part.bytes > 0)
      result.at_peak.push_back(life.part);
  }
  std::stable_sort(result.at_peak.begin(), result.at_peak.end(),
                   [](const auto& a, const auto& b) { return a.bytes > b.bytes; });
  return result;
}

}  // namespace retrograde::autoschedule
