#include "autoschedule/memory_estimate.h"

#include <algorithm>
#include <string>
#include <unordered_map>

#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

using LevelKind = graph::LoopLevel::Kind;

// When each Func is computed and read last, as places in the order of the graph.
class Lives {
 public:
  explicit Lives(const std::vector<FuncPtr>& outputs) : order_(topological_order(outputs)) {
    for (size_t i = 0; i < order_.size(); ++i) by_name_[order_[i]->name] = i;
    last_.resize(order_.size());
    for (const FuncPtr& f : outputs) last_[by_name_.at(f->name)] = order_.size();
    for (size_t i = order_.size(); i-- > 0;) {
      const size_t at = is_inlined(*order_[i]) ? last_[i] : nest(i);
      last_[i] = std::max(last_[i], at);
      for (const FuncPtr& callee : direct_callees(*order_[i])) {
        size_t& last = last_[by_name_.at(callee->name)];
        last = std::max(last, at);
      }
    }
  }

  const std::vector<FuncPtr>& order() const { return order_; }
  size_t last(size_t f) const { return last_[f]; }
  static bool is_inlined(const FuncContents& f) {
    return f.is_pure() && f.schedule.compute_level.kind == LevelKind::Inlined;
  }
  // The Func at root in whose loops f is stored: itself, or another.
  size_t nest(size_t f) const {
    for (size_t steps = 0; steps < order_.size(); ++steps) {
      const graph::LoopLevel& level = order_[f]->schedule.compute_level;
      const auto host = by_name_.find(level.func);
      if (level.kind != LevelKind::At || host == by_name_.end()) break;
      f = host->second;
    }
    return f;
  }
  const FuncContents* host_of(const FuncContents& f) const {
    const graph::LoopLevel& level = f.schedule.compute_level;
    const auto host = by_name_.find(level.func);
    return level.kind == LevelKind::At && host != by_name_.end() ? order_[host->second].get()
                                                                 : nullptr;
  }

 private:
  const std::vector<FuncPtr> order_;
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
    const bool is_output = std::find(outputs.begin(), outputs.end(), order[i]) != outputs.end();
    if (is_output || Lives::is_inlined(*order[i])) continue;
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
