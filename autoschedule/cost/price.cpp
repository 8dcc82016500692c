// price.cpp -- the price of a plan: groups that are priced alone, and what the caches keep from one to the next.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/recent.h"
#include "autoschedule/cost/terms.h"

namespace retrograde::planning {

namespace {

constexpr double ns = 1e-9;

struct GroupPrice {
  std::vector<StageCost> stages;  // without memory
  GroupTraffic traffic;
  double allocated_bytes = 0;  // for Funcs that are computed in its loops
};

// Plans of Funcs by their addresses, which nobody else gets as long as they are kept.
class Hashes {
 public:
  uint64_t of(const std::shared_ptr<const FuncPlan>& plan) {
    const auto [entry, is_new] = known_.try_emplace(plan.get());
    if (is_new) entry->second = {plan, hash_of(*plan)};
    return entry->second.second;
  }

 private:
  std::unordered_map<const FuncPlan*, std::pair<std::shared_ptr<const FuncPlan>, uint64_t>> known_;
};

using Key = std::vector<uint64_t>;
struct KeyHash {
  size_t operator()(const Key& key) const {
    size_t hash = key.size();
    for (const uint64_t word : key) hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
  }
};

}  // namespace

class CostModel::Prices {
 public:
  Prices(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine)
      : graph_(accesses), sizes_(sizes), machine_(machine), facts_(sizes, machine) {}

  Cost price(const Plan& plan) {
    const std::vector<PlannedGroup> groups = groups_of(plan, graph_);
    Covers covers(plan, sizes_);
    std::vector<const GroupPrice*> prices;
    for (const PlannedGroup& group : groups) prices.push_back(&price_of(plan, group, covers));
    Cost cost;
    RecentBuffers recent(graph_.funcs().size() + graph_.images().size());
    // The call is one of many: what the last one left in the caches counts.
    for (const GroupPrice* price : prices) leave(*price, recent);
    for (const GroupPrice* price : prices) {
      add_stages(*price, recent, cost);
      leave(*price, recent);
    }
    std::ranges::sort(cost.stages, {}, &StageCost::stage);
    for (const StageCost& stage : cost.stages) cost.seconds += stage.seconds;
    cost.peak_bytes =
        peak_bytes(plan, sizes_, groups,
                   ir::mapped(prices, [](const GroupPrice* p) { return p->allocated_bytes; }));
    return cost;
  }
  size_t groups_priced() const { return known_.size(); }

 private:
  const AccessGraph& graph_;
  const SizeModel& sizes_;
  const Machine& machine_;
  FactsOfStages facts_;
  Hashes hashes_;
  std::unordered_map<Key, GroupPrice, KeyHash> known_;

  // All that the price of a group depends on.
  Key key_of(const Plan& plan, const PlannedGroup& group) {
    Key key;
    const auto add = [&](auto... words) {
      key.insert(key.end(), {static_cast<uint64_t>(words)...});
    };
    for (const FuncId func : group.funcs)
      add(func, hashes_.of(plan.funcs[static_cast<size_t>(func)]));
    for (const std::vector<FuncId>& inlined : group.inlined) {
      add(-1);
      key.insert(key.end(), inlined.begin(), inlined.end());
    }
    add(-1);
    for (const FuncId read : group.reads) {
      add(read);
      for (const int16_t dimension : plan.of(read).storage.order) add(dimension);
      for (const Fold& fold : plan.of(read).storage.folds) add(fold.dimension, fold.extent);
    }
    return key;
  }

  const GroupPrice& price_of(const Plan& plan, const PlannedGroup& planned, Covers& covers) {
    Key key = key_of(plan, planned);
    if (const GroupPrice* found = ir::find_or_null(known_, key)) return *found;
    const Group group = group_of(plan, planned, covers, sizes_, machine_, facts_);
    GroupPrice price;
    price.traffic = traffic_of(group, machine_);
    for (const StageRun& run : group.runs) price.stages.push_back(cost_of(run, group));
    for (const auto& [buffer, stored] : group.buffers)
      price.allocated_bytes += stored.allocated_bytes;
    return known_.emplace(std::move(key), std::move(price)).first->second;
  }

  StageCost cost_of(const StageRun& run, const Group& group) const {
    StageCost cost;
    cost.stage = run.id;
    const LoopNode& innermost = group.nodes[static_cast<size_t>(run.path.back())];
    cost.compute_seconds = work_of(run, group, machine_).all() / innermost.speedup * ns;
    if (run.id.stage == 0) cost.compute_seconds += heap_seconds(run, group);
    for (const int n : run.path) {
      const LoopNode& node = group.nodes[static_cast<size_t>(n)];
      if (node.loop.stage != run.id || !runs_at_once(node.kind) || node.trips <= 1) continue;
      const LoopNode& outer = group.nodes[static_cast<size_t>(node.parent)];
      cost.launch_seconds += outer.times / outer.speedup * machine_.launch_ns * ns;
    }
    return cost;
  }

  double heap_seconds(const StageRun& run, const Group& group) const {
    const LoopNode& around = group.nodes[static_cast<size_t>(run.path[run.storage_place - 1])];
    const StoredBuffer* stored = ir::find_or_null(group.buffers, run.id.func);
    const double blocks = stored ? stored->heap_blocks * around.times : 0;
    return blocks * heap_block_operations * machine_.scalar_ns / around.speedup * ns;
  }

  // ---- memory ----

  static double overlapped(double a, double b) {
    return std::max(a, b) + not_overlapped * std::min(a, b);
  }

  static void leave(const GroupPrice& price, RecentBuffers& recent) {
    for (const auto& [buffer, bytes] : price.traffic.touched) recent.touch(buffer, bytes);
  }

  // A cache supplies what the smaller one lacks and it has.
  void add_stages(const GroupPrice& price, const RecentBuffers& recent, Cost& cost) const {
    struct Bytes {
      double serial = 0, parallel = 0;
      double waiting_ns = 0;  // of each thread
    };
    std::vector<std::array<Bytes, Machine::level_count>> behind(price.stages.size());
    const double most = machine_.levels[Machine::last_cache].bytes;
    std::vector<std::pair<int, double>> distances;
    for (const auto& [buffer, bytes] : price.traffic.touched)
      distances.emplace_back(buffer, recent.distance(buffer, bytes, most));
    const auto distance_of = [&](int buffer) {
      const auto found = std::ranges::find(distances, buffer, &std::pair<int, double>::first);
      return found == distances.end() ? 0 : found->second;
    };
    for (size_t level = 0; level < price.traffic.behind.size(); ++level) {
      const double room = usable_share * machine_.levels[level].bytes;
      for (const BufferTraffic& traffic : price.traffic.behind[level]) {
        const bool is_there = distance_of(traffic.buffer) <= room;
        const double bytes = traffic.bytes - (is_there ? traffic.first_bytes : 0);
        Bytes& all = behind[static_cast<size_t>(traffic.run)][level];
        (traffic.in_parallel ? all.parallel : all.serial) += bytes;
        const double threads = traffic.in_parallel ? machine_.threads : 1;
        if (bytes > 0) all.waiting_ns += traffic.waiting_ns * bytes / traffic.bytes / threads;
      }
    }
    for (size_t s = 0; s < price.stages.size(); ++s) {
      StageCost stage = price.stages[s];
      for (size_t level = 1; level < Machine::level_count; ++level) {
        const Bytes &in = behind[s][level - 1], &out = behind[s][level];
        const double serial = std::max(0.0, in.serial - out.serial);
        const double parallel = std::max(0.0, in.parallel - out.parallel);
        const Machine::Level& from = machine_.levels[level];
        const double shared = machine_.threads == 1 ? from.one_thread : from.all_threads;
        stage.bytes[level] = serial + parallel;
        const double moving_ns = serial / from.one_thread + parallel / shared;
        stage.memory_seconds[level] = overlapped(moving_ns, in.waiting_ns) * ns;
      }
      const double memory = stage.all_memory_seconds();
      stage.seconds = overlapped(stage.compute_seconds, memory) + stage.launch_seconds;
      cost.stages.push_back(stage);
    }
  }
};

CostModel::CostModel(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine)
    : prices_(std::make_unique<Prices>(accesses, sizes, machine)) {}
CostModel::~CostModel() = default;

Cost CostModel::price(const Plan& plan) { return prices_->price(plan); }
size_t CostModel::groups_priced() const { return prices_->groups_priced(); }

double StageCost::all_memory_seconds() const {
  return std::accumulate(memory_seconds.begin(), memory_seconds.end(), 0.0);
}

std::string StageCost::bound_by() const {
  const double memory = all_memory_seconds();
  if (launch_seconds > std::max(compute_seconds, memory)) return "launch";
  if (compute_seconds >= memory) return "compute";
  static constexpr std::array<const char*, Machine::level_count> names{"L1", "L2", "L3", "memory"};
  return names[static_cast<size_t>(std::ranges::max_element(memory_seconds) -
                                   memory_seconds.begin())];
}

}  // namespace retrograde::planning
