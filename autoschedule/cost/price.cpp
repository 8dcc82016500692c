// price.cpp -- the price of a plan: groups that are priced alone.
#include <algorithm>
#include <numeric>
#include <unordered_map>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/cost.h"
#include "autoschedule/cost/supply.h"

namespace retrograde::planning {

namespace {

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
  Prices(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine,
         const Device* device)
      : graph_(accesses),
        sizes_(sizes),
        machine_(machine),
        device_(device),
        facts_(sizes, machine),
        places_(places_in_order(accesses)),
        groups_(accesses),
        supply_(machine, accesses.funcs().size(),
                accesses.funcs().size() + accesses.images().size()),
        funcs_(accesses.funcs().size()),
        root_bytes_(funcs_.size()),
        own_bytes_(funcs_.size()),
        code_(funcs_.size()) {}

  Totals totals(const Plan& plan) {
    follow(plan);
    return {supply_.seconds(), peak_bytes(groups_.all(), places_, root_bytes_, own_bytes_),
            std::accumulate(code_.begin(), code_.end(), 0.0)};
  }
  Cost price(const Plan& plan) {
    Cost cost{totals(plan), {}};
    for (size_t g = 0; g < funcs_.size(); ++g) ir::append(cost.stages, supply_.stages(g));
    std::ranges::sort(cost.stages, {}, &StageCost::stage);
    return cost;
  }
  size_t groups_priced() const { return known_.size(); }

 private:
  const AccessGraph& graph_;
  const SizeModel& sizes_;
  const Machine& machine_;
  const Device* const device_;
  FactsOfStages facts_;
  const std::vector<size_t> places_;
  std::unordered_map<Key, GroupPrice, KeyHash> known_;

  // ---- the last plan, of which the next one changes a part ----

  struct RunningFunc {
    std::shared_ptr<const FuncPlan> plan;
    uint64_t hash = 0;
  };
  ProgramGroups groups_;
  CacheSupply supply_;
  std::vector<RunningFunc> funcs_;
  std::vector<double> root_bytes_, own_bytes_, code_;  // by Func; by group

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
    for (const FuncId number : groups_.update(plan, changed)) {
      const auto g = static_cast<size_t>(number);
      const PlannedGroup& planned = groups_.all()[g];
      const GroupPrice* price = planned.funcs.empty() ? nullptr : &price_of(plan, planned, covers);
      supply_.change(g, price);
      own_bytes_[g] = price ? price->allocated_bytes : 0;
      code_[g] = price ? price->code : 0;
    }
    supply_.update();
    for (const FuncId f : changed)
      funcs_[static_cast<size_t>(f)].plan = plan.funcs[static_cast<size_t>(f)];
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
    const bool on_device = device_ && has_kernels(group);
    for (const StageRun& run : group.runs)
      price.stages.push_back(on_device ? kernel_cost(run, group, *device_, machine_)
                                       : cost_of(run, group));
    for (const StageCost& stage : price.stages) price.code += stage.code;
    if (!on_device) {
      price.traffic = traffic_of(group, machine_);
      for (const auto& [buffer, stored] : group.buffers)
        price.allocated_bytes += stored.allocated_bytes;
    }
    return known_.emplace(std::move(key), std::move(price)).first->second;
  }

  StageCost cost_of(const StageRun& run, const Group& group) const {
    StageCost cost;
    cost.stage = run.id;
    const LoopNode& innermost = group.nodes[static_cast<size_t>(run.path.back())];
    const UnitTimes work = work_of(run, group, machine_);
    cost.code = work.code;
    cost.compute_seconds = work.all() / innermost.speedup * nanosecond;
    if (run.id.stage == 0) cost.compute_seconds += heap_seconds(run, group);
    for (const int n : run.path) {
      const LoopNode& node = group.nodes[static_cast<size_t>(n)];
      if (node.loop.stage != run.id || !runs_at_once(node.kind) || node.trips <= 1) continue;
      const LoopNode& outer = group.nodes[static_cast<size_t>(node.parent)];
      cost.launch_seconds += outer.times / outer.speedup * machine_.launch_ns * nanosecond;
    }
    return cost;
  }

  double heap_seconds(const StageRun& run, const Group& group) const {
    const LoopNode& around = group.nodes[static_cast<size_t>(run.path[run.storage_place - 1])];
    const StoredBuffer* stored = ir::find_or_null(group.buffers, run.id.func);
    const double blocks = stored ? stored->heap_blocks * around.times : 0;
    return blocks * heap_block_operations * machine_.scalar_ns / around.speedup * nanosecond;
  }
};

CostModel::CostModel(const AccessGraph& accesses, const SizeModel& sizes, const Machine& machine,
                     const Device* device)
    : prices_(std::make_unique<Prices>(accesses, sizes, machine, device)) {}
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
