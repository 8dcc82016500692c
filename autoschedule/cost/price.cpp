// price.cpp -- the price of a plan: groups that are priced alone, and what the caches keep from one to the next.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <ranges>
#include <unordered_map>
#include <utility>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/terms.h"

namespace retrograde::planning {

namespace {

constexpr double ns = 1e-9;

struct GroupPrice {
  std::vector<StageCost> stages;  // without memory
  GroupTraffic traffic;
  double allocated_bytes = 0;  // for Funcs that are computed in its loops
};

using Touched = std::vector<std::pair<int, double>>;  // buffers with their bytes
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
      : graph_(accesses),
        sizes_(sizes),
        machine_(machine),
        facts_(sizes, machine),
        groups_(accesses),
        funcs_(accesses.funcs().size()),
        running_(funcs_.size()),
        root_bytes_(funcs_.size()),
        own_bytes_(funcs_.size()),
        buffers_(funcs_.size() + accesses.images().size()) {
    for (const FuncNode& func : accesses.funcs()) {
      first_stage_.push_back(seconds_.size());
      seconds_.resize(seconds_.size() + func.stages.size());
    }
  }

  Totals totals(const Plan& plan) {
    follow(plan);
    return {std::accumulate(seconds_.begin(), seconds_.end(), 0.0),
            peak_bytes(groups_.all(), root_bytes_, own_bytes_)};
  }
  Cost price(const Plan& plan) {
    Cost cost{totals(plan), {}};
    for (const RunningGroup& group : running_) ir::append(cost.stages, group.stages);
    std::ranges::sort(cost.stages, {}, &StageCost::stage);
    return cost;
  }
  size_t groups_priced() const { return known_.size(); }

 private:
  const AccessGraph& graph_;
  const SizeModel& sizes_;
  const Machine& machine_;
  FactsOfStages facts_;
  std::unordered_map<Key, GroupPrice, KeyHash> known_;

  // ---- the last plan, of which the next one changes a part ----

  struct RunningGroup {
    const GroupPrice* price = nullptr;  // null: no group has the number
    std::vector<StageCost> stages;      // with memory
    // The groups from this one to the one before, perhaps those of the call before, decide what the caches hold. If they
    // touch fewer bytes more or less, and the same of the group's buffers, it stays.
    size_t since = 0;
    double spare_bytes = 0;
    bool is_changed = false;
  };
  struct RunningFunc {
    std::shared_ptr<const FuncPlan> plan;
    uint64_t hash = 0;
  };
  ProgramGroups groups_;
  std::vector<RunningFunc> funcs_;
  std::vector<RunningGroup> running_;  // by number
  std::vector<double> root_bytes_, own_bytes_;
  struct Buffer {
    uint64_t noted = 0, change = 0;  // the last changes of groups that touch it, and of how they do
    uint64_t look = 0;               // the last one that found it
    double most_bytes = 0;           // that any group touched
  };
  std::vector<Buffer> buffers_;
  uint64_t change_ = 0, look_ = 0;
  double changed_bytes_ = 0;         // of all buffers that changed groups touch
  std::vector<size_t> first_stage_;  // by Func
  std::vector<double> seconds_;      // of all stages

  void follow(const Plan& plan) {
    std::vector<FuncId> changed;
    for (size_t f = 0; f < funcs_.size(); ++f) {
      if (funcs_[f].plan == plan.funcs[f]) continue;
      changed.push_back(static_cast<FuncId>(f));
      funcs_[f] = {nullptr, hash_of(*plan.funcs[f])};
      root_bytes_[f] = allocated_bytes(changed.back(), plan, sizes_);
    }
    if (changed.empty()) return;
    Covers covers(plan, sizes_);
    ++change_;
    changed_bytes_ = 0;
    for (const FuncId number : groups_.update(plan, changed)) {
      RunningGroup& group = running_[static_cast<size_t>(number)];
      for (const StageCost& stage : group.stages) seconds_of(stage.stage) = 0;
      const PlannedGroup& planned = groups_.all()[static_cast<size_t>(number)];
      const GroupPrice* price = planned.funcs.empty() ? nullptr : &price_of(plan, planned, covers);
      note_change(group.price, price);
      note_change(price, group.price);
      group = {price, {}, 0, 0, true};
      own_bytes_[static_cast<size_t>(number)] = group.price ? group.price->allocated_bytes : 0;
    }
    supply();
    for (const FuncId f : changed)
      funcs_[static_cast<size_t>(f)].plan = plan.funcs[static_cast<size_t>(f)];
  }

  // Notes the buffers that one price of a group has, and which of them the other one lacks or touches otherwise.
  void note_change(const GroupPrice* price, const GroupPrice* other) {
    if (!price) return;
    for (const auto& touched : price->traffic.touched) {
      Buffer& buffer = buffers_[static_cast<size_t>(touched.first)];
      const double more = std::max(0.0, touched.second - buffer.most_bytes);
      buffer.most_bytes += more;
      const bool is_noted = std::exchange(buffer.noted, change_) == change_;
      changed_bytes_ += is_noted ? more : buffer.most_bytes;
      const bool is_same = other && std::ranges::find(other->traffic.touched, touched) !=
                                        other->traffic.touched.end();
      if (!is_same) buffer.change = change_;
    }
  }
  bool touches_changed(const RunningGroup& group) const {
    return std::ranges::any_of(group.price->traffic.touched, [&](const auto& touched) {
      return buffers_[static_cast<size_t>(touched.first)].change == change_;
    });
  }

  // Finds what caches supply where that may differ from the last plan.
  void supply() {
    std::optional<size_t> before, last;  // the last changed group, before this one and of all
    for (size_t g = 0; g < running_.size(); ++g)
      if (running_[g].is_changed) last = g;
    for (size_t g = 0; g < running_.size(); ++g) {
      RunningGroup& group = running_[g];
      const bool is_near = group.since < g ? before >= group.since : before || last >= group.since;
      if (is_near) group.spare_bytes -= changed_bytes_;
      const auto is_other = [&] {
        return is_near && (group.spare_bytes <= 0 || touches_changed(group));
      };
      if (group.price && (group.is_changed || is_other())) {
        group.stages = stages_of(g);
        for (const StageCost& stage : group.stages) seconds_of(stage.stage) = stage.seconds;
      }
      if (group.is_changed) before = g;
    }
    for (RunningGroup& group : running_) group.is_changed = false;
  }
  double& seconds_of(StageId stage) {
    return seconds_[first_stage_[static_cast<size_t>(stage.func)] +
                    static_cast<size_t>(stage.stage)];
  }

  // All that the price of a group depends on.
  Key key_of(const Plan& plan, const PlannedGroup& group) {
    Key key;
    const auto add = [&](auto... words) {
      key.insert(key.end(), {static_cast<uint64_t>(words)...});
    };
    for (const FuncId func : group.funcs) add(func, funcs_[static_cast<size_t>(func)].hash);
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

  // The bytes that were touched since each buffer of a group was, with its own; infinite if most of it was not, or the last
  // cache forgot it. The call is one of many: what the last one left in the caches counts.
  Touched distances_of(size_t g) {
    const Touched& touched = running_[g].price->traffic.touched;
    Touched distances = touched;
    for (auto& [buffer, distance] : distances) distance = INFINITY;
    const double most = machine_.levels[Machine::last_cache].bytes;
    size_t left = touched.size();
    double sum = 0;
    ++look_;
    for (size_t back = 1; back <= running_.size() && left > 0 && sum <= most; ++back) {
      const size_t at = (g + running_.size() - back) % running_.size();
      running_[g].since = at;
      if (!running_[at].price) continue;
      for (const auto& [buffer, bytes] : std::views::reverse(running_[at].price->traffic.touched)) {
        const bool is_seen =
            std::exchange(buffers_[static_cast<size_t>(buffer)].look, look_) == look_;
        if (is_seen || sum > most) continue;
        sum += bytes;
        const auto own = std::ranges::find(touched, buffer, &std::pair<int, double>::first);
        if (own == touched.end()) continue;
        --left;
        if (2 * bytes >= own->second)
          distances[static_cast<size_t>(own - touched.begin())].second = sum;
      }
    }
    double& spare = running_[g].spare_bytes;
    spare = sum > most ? most - room(Machine::last_cache) : INFINITY;
    for (const auto& [buffer, distance] : distances) {
      for (size_t level = 0; level <= Machine::last_cache && distance <= most; ++level)
        spare = std::min(spare, std::abs(distance - room(level)));
    }
    return distances;
  }
  double room(size_t level) const { return usable_share * machine_.levels[level].bytes; }

  // A cache supplies what the smaller one lacks and it has.
  std::vector<StageCost> stages_of(size_t g) {
    struct Bytes {
      double serial = 0, parallel = 0;
      double waiting_ns = 0;  // of each thread
    };
    const GroupPrice& price = *running_[g].price;
    std::vector<std::array<Bytes, Machine::level_count>> behind(price.stages.size());
    const Touched distances = distances_of(g);
    const auto distance_of = [&](int buffer) {
      const auto found = std::ranges::find(distances, buffer, &std::pair<int, double>::first);
      return found == distances.end() ? 0 : found->second;
    };
    for (size_t level = 0; level < price.traffic.behind.size(); ++level) {
      for (const BufferTraffic& traffic : price.traffic.behind[level]) {
        const bool is_there = distance_of(traffic.buffer) <= room(level);
        const double bytes = traffic.bytes - (is_there ? traffic.first_bytes : 0);
        Bytes& all = behind[static_cast<size_t>(traffic.run)][level];
        (traffic.in_parallel ? all.parallel : all.serial) += bytes;
        const double threads = traffic.in_parallel ? machine_.threads : 1;
        if (bytes > 0) all.waiting_ns += traffic.waiting_ns * bytes / traffic.bytes / threads;
      }
    }
    std::vector<StageCost> stages = price.stages;
    for (size_t s = 0; s < stages.size(); ++s) {
      StageCost& stage = stages[s];
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
    }
    return stages;
  }
};

CostModel::CostModel(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine)
    : prices_(std::make_unique<Prices>(accesses, sizes, machine)) {}
CostModel::~CostModel() = default;

Cost CostModel::price(const Plan& plan) { return prices_->price(plan); }
Totals CostModel::totals(const Plan& plan) { return prices_->totals(plan); }
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
