// price.cpp -- the price of a plan: groups that are priced alone, and what the caches keep from one to the next.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/liveness.h"
#include "autoschedule/cost/program_groups.h"
#include "autoschedule/cost/traffic.h"
#include "autoschedule/cost/work.h"

namespace retrograde::planning {

namespace {

constexpr double ns = 1e-9;

struct GroupPrice {
  std::vector<StageCost> stages;  // without memory
  GroupTraffic traffic;
  double allocated_bytes = 0;  // for Funcs that are computed in its loops
};

// The numbers of equal values.
template <class T>
class Numbers {
 public:
  int of(const std::shared_ptr<const T>& value) {
    const auto [entry, is_new] = known_.try_emplace(value.get(), 0);
    if (!is_new) return entry->second;
    kept_.push_back(value);
    std::vector<int>& like = by_hash_[hash_of(*value)];
    const int* equal = ir::first_where(
        like, [&](int number) { return *kept_[static_cast<size_t>(number)] == *value; });
    if (!equal) like.push_back(static_cast<int>(kept_.size()) - 1);
    return entry->second = equal ? *equal : static_cast<int>(kept_.size()) - 1;
  }

 private:
  std::unordered_map<const T*, int> known_;
  std::vector<std::shared_ptr<const T>> kept_;  // so that no other one gets their address
  std::unordered_map<uint64_t, std::vector<int>> by_hash_;
};

using Key = std::vector<int>;
struct KeyHash {
  size_t operator()(const Key& key) const {
    size_t hash = key.size();
    for (const int word : key) hash = (hash ^ static_cast<size_t>(word)) * 0x9e3779b97f4a7c15u;
    return hash ^ hash >> 29;
  }
};

// Buffers in the order in which they were touched, as a list, the latest first.
class Residents {
 public:
  explicit Residents(size_t buffers)
      : next_(buffers + 1, -1), last_(buffers + 1, -1), bytes_(buffers) {
    head_ = buffers;
  }
  // The bytes touched since, with its own; infinite if it was never touched.
  double distance(int buffer, double most) const {
    double sum = 0;
    for (int b = next_[head_]; b >= 0 && sum <= most; b = next_[static_cast<size_t>(b)]) {
      sum += bytes_[static_cast<size_t>(b)];
      if (b == buffer) return sum;
    }
    return INFINITY;
  }
  double bytes(int buffer) const { return bytes_[static_cast<size_t>(buffer)]; }
  void touch(int buffer, double bytes) {
    const auto b = static_cast<size_t>(buffer);
    if (last_[b] >= 0) {
      next_[static_cast<size_t>(last_[b])] = next_[b];
      if (next_[b] >= 0) last_[static_cast<size_t>(next_[b])] = last_[b];
    }
    bytes_[b] = bytes;
    next_[b] = next_[head_];
    last_[b] = static_cast<int>(head_);
    if (next_[b] >= 0) last_[static_cast<size_t>(next_[b])] = buffer;
    next_[head_] = buffer;
  }

 private:
  std::vector<int> next_, last_;
  std::vector<double> bytes_;
  size_t head_;
};

}  // namespace

class CostModel::Prices {
 public:
  Prices(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine)
      : graph_(accesses),
        sizes_(sizes),
        machine_(machine),
        finder_(accesses),
        facts_(sizes, machine) {}

  Cost price(const Plan& plan) {
    const std::vector<PlannedGroup> groups = finder_.groups_of(plan);
    Covers covers(plan, sizes_);
    std::vector<const GroupPrice*> prices;
    for (const PlannedGroup& group : groups) prices.push_back(&price_of(plan, group, covers));
    Cost cost;
    Residents residents(graph_.funcs().size() + graph_.images().size());
    // The call is one of many: what the last one left in the caches counts.
    for (const GroupPrice* price : prices) leave(*price, residents);
    for (const GroupPrice* price : prices) {
      add_stages(*price, residents, cost);
      leave(*price, residents);
    }
    std::ranges::sort(cost.stages, {}, &StageCost::stage);
    for (const StageCost& stage : cost.stages) cost.seconds += stage.seconds;
    cost.peak_bytes = peak_of(plan, groups, prices);
    return cost;
  }
  size_t groups_priced() const { return known_.size(); }

 private:
  const AccessGraph& graph_;
  const SizeModel& sizes_;
  const Machine& machine_;
  const GroupFinder finder_;
  FactsOfStages facts_;
  Numbers<FuncPlan> numbers_;
  std::unordered_map<Key, GroupPrice, KeyHash> known_;

  Key key_of(const Plan& plan, const PlannedGroup& group) {
    Key key;
    const auto number = [&](FuncId func) {
      return numbers_.of(plan.funcs[static_cast<size_t>(func)]);
    };
    for (const FuncId func : group.members.funcs) key.insert(key.end(), {func, number(func)});
    for (const std::vector<FuncId>& inlined : group.members.inlined) {
      key.push_back(-1);
      ir::append(key, inlined);
    }
    key.push_back(-1);
    for (const FuncId read : group.reads) {
      key.push_back(read);
      for (const int16_t dimension : plan.of(read).storage.order) key.push_back(dimension);
      for (const Fold& fold : plan.of(read).storage.folds)
        key.insert(key.end(), {fold.dimension, static_cast<int>(fold.extent)});
    }
    return key;
  }

  const GroupPrice& price_of(const Plan& plan, const PlannedGroup& planned, Covers& covers) {
    Key key = key_of(plan, planned);
    if (const GroupPrice* found = ir::find_or_null(known_, key)) return *found;
    const Group group = group_of(plan, planned.members, covers, sizes_, machine_, facts_);
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
    for (const int n : run.path) {
      const LoopNode& node = group.nodes[static_cast<size_t>(n)];
      if (node.loop.stage != run.id || !runs_at_once(node.kind) || node.trips <= 1) continue;
      const LoopNode& outer = group.nodes[static_cast<size_t>(node.parent)];
      cost.launch_seconds += outer.times / outer.speedup * machine_.launch_ns * ns;
    }
    return cost;
  }

  // ---- memory ----

  static void leave(const GroupPrice& price, Residents& residents) {
    for (const auto& [buffer, bytes] : price.traffic.touched) residents.touch(buffer, bytes);
  }

  // What a cache supplies is what the smaller one lacks and it has.
  void add_stages(const GroupPrice& price, const Residents& residents, Cost& cost) const {
    struct Bytes {
      double serial = 0, parallel = 0;
    };
    std::vector<std::array<Bytes, Machine::level_count>> behind(price.stages.size());
    const double most = machine_.levels[Machine::last_cache].bytes;
    std::unordered_map<int, double> distances;
    for (const auto& [buffer, bytes] : price.traffic.touched) {
      const bool is_there = 2 * residents.bytes(buffer) >= bytes;
      distances[buffer] = is_there ? residents.distance(buffer, most) : INFINITY;
    }
    for (size_t level = 0; level < price.traffic.behind.size(); ++level) {
      const double room = usable_share * machine_.levels[level].bytes;
      for (const BufferTraffic& traffic : price.traffic.behind[level]) {
        const bool is_there = distances[traffic.buffer] <= room;
        const double bytes = traffic.bytes - (is_there ? traffic.first_bytes : 0);
        Bytes& all = behind[static_cast<size_t>(traffic.run)][level];
        (traffic.in_parallel ? all.parallel : all.serial) += bytes;
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
        stage.memory_seconds[level] = (serial / from.one_thread + parallel / shared) * ns;
      }
      const double memory = stage.all_memory_seconds();
      stage.seconds = std::max(stage.compute_seconds, memory) +
                      not_overlapped * std::min(stage.compute_seconds, memory) +
                      stage.launch_seconds;
      cost.stages.push_back(stage);
    }
  }

  // ---- liveness ----

  double bytes_of(FuncId func, const FuncPlan& plan) const {
    const FuncContents& f = *graph_.func(func).func;
    double bytes = 0;
    for (const Type& type : f.types) bytes += type.bytes();
    for (size_t d = 0; d < f.args.size(); ++d) {
      auto extent = static_cast<double>(std::max<int64_t>(sizes_.of(func, d).estimate, 1));
      for (const Fold& fold : plan.storage.folds)
        if (fold.dimension == static_cast<int>(d))
          extent = std::min(extent, static_cast<double>(fold.extent));
      bytes *= extent;
    }
    return bytes;
  }

  double peak_of(const Plan& plan, const std::vector<PlannedGroup>& groups,
                 const std::vector<const GroupPrice*>& prices) const {
    std::vector<LiveBuffer> buffers;
    std::vector<int> number(plan.funcs.size(), -1);  // of the buffer
    std::vector<double> own;
    for (size_t g = 0; g < groups.size(); ++g) {
      own.push_back(prices[g]->allocated_bytes);
      for (const FuncId func : groups[g].members.funcs) {
        const FuncPlan& of = plan.of(func);
        if (of.placement.compute.kind == Level::Kind::At || graph_.func(func).is_output) continue;
        number[static_cast<size_t>(func)] = static_cast<int>(buffers.size());
        buffers.push_back({g, g, bytes_of(func, of)});
      }
      for (const FuncId read : groups[g].reads)
        if (const int n = number[static_cast<size_t>(read)]; n >= 0)
          buffers[static_cast<size_t>(n)].last = g;
    }
    return peak_bytes(buffers, own);
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
