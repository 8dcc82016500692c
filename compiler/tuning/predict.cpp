#include "tuning/predict.h"

#include <algorithm>
#include <memory>
#include <numeric>

#include "tuning/memory_traffic.h"

namespace retrograde::tuning {

namespace {

constexpr double ns = 1e-9;
// What units cannot do at the same time: of all that they do beside the slowest of them.
constexpr double not_overlapped = 0.25;

// The time of one iteration on one thread, and the parts of it that StagePrediction lists.
struct ComputeTime {
  double all = 0, chains = 0, elements = 0, scalars = 0;
};

ComputeTime compute_ns(const Work& work, const planning::Machine& m) {
  const double arithmetic = work.operations * m.operation_ns + work.shuffles * m.shuffle_ns +
                            work.divisions * m.divide_ns +
                            work.double_divisions * m.divide_double_ns + work.roots * m.sqrt_ns +
                            work.double_roots * m.sqrt_double_ns + work.exps * m.exp_ns +
                            work.logs * m.log_ns + work.pows * m.pow_ns + work.sines * m.sin_ns;
  const double gathers = work.gather_lanes * m.gather_lane_ns;
  const double scatters = work.scatter_lanes * m.scatter_lane_ns;
  const double loads = work.loads * m.load_ns + gathers;
  const double stores = work.stores * m.store_ns + scatters;
  const double scalars = work.scalars * m.scalar_ns + work.scalar_divisions * m.scalar_divide_ns;
  const double slowest = std::max({arithmetic, loads, stores, scalars});
  const double all = arithmetic + loads + stores + scalars;
  const double chains = work.chain * m.latency_ns + work.memory_chain * m.memory_latency_ns;
  const double units = slowest + not_overlapped * (all - slowest);
  return {std::max(units, chains), chains > units ? chains : 0, gathers + scatters, scalars};
}

// What does not depend on times, only on how large vectors and caches are.
struct Program {
  WorkTree tree;
  std::vector<std::vector<Traffic>> behind;  // by level, by stage

  Program(const LoweredFunction& function, const ProgramSizes& sizes,
          const planning::Machine& machine, int threads)
      : tree(work_tree(function, sizes, {machine.vector_bytes, machine.registers, threads})) {
    const MemoryTraffic traffic(tree);
    for (size_t level = 0; level + 1 < planning::Machine::level_count; level++)
      behind.push_back(traffic.behind(machine.levels[level].bytes));
    behind.emplace_back(tree.stages.size());  // nothing lies behind memory
  }
};

class Predictor {
 public:
  Predictor(const Program& program, const planning::Machine& machine)
      : tree_(program.tree),
        behind_(program.behind),
        machine_(machine),
        stages_(program.tree.stages.size()) {
    const WorkTree& tree = tree_;
    for (size_t s = 0; s < stages_.size(); s++) stages_[s].name = tree.stages[s];
  }

  Prediction predict() {
    for (size_t n = 0; n < tree_.nodes.size(); n++) add_node(n);
    add_traffic();
    Prediction result;
    for (StagePrediction& stage : stages_) {
      const double memory = stage.all_memory_seconds();
      stage.seconds = std::max(stage.compute_seconds, memory) +
                      not_overlapped * std::min(stage.compute_seconds, memory) +
                      stage.launch_seconds;
      result.seconds += stage.seconds;
      if (stage.seconds > 0) result.stages.push_back(std::move(stage));
    }
    for (const WorkTree::Memory& memory : tree_.buffers) {
      if (memory.is_allocated)
        result.first_call_seconds += memory.bytes / planning::page_bytes * machine_.page_ns * ns;
    }
    return result;
  }

 private:
  const WorkTree& tree_;
  const std::vector<std::vector<Traffic>>& behind_;
  const planning::Machine& machine_;
  std::vector<StagePrediction> stages_;

  void add_node(size_t n) {
    const WorkNode& node = tree_.nodes[n];
    const double times = tree_.times(static_cast<int>(n)), share = times / node.speedup;
    for (const auto& [stage, work] : node.work) {
      StagePrediction& of = stages_[static_cast<size_t>(stage)];
      const ComputeTime time = compute_ns(work, machine_);
      of.compute_seconds += share * time.all * ns;
      of.chain_seconds += share * time.chains * ns;
      of.element_seconds += share * time.elements * ns;
      of.scalar_seconds += share * time.scalars * ns;
      if (node.speedup <= 1) of.one_thread_seconds += share * time.all * ns;
      of.work.add(work, times);
    }
    StagePrediction& own = stages_[static_cast<size_t>(node.stage)];
    if (node.is_loop()) own.compute_seconds += share * machine_.iteration_ns * ns;
    if (node.kind == WorkNode::Kind::Parallel && node.trips > 1) {
      const WorkNode& outer = tree_.nodes[static_cast<size_t>(node.parent)];
      own.launch_seconds += times / node.trips / outer.speedup * machine_.launch_ns * ns;
    }
  }

  void add_traffic() {
    for (size_t level = 1; level < planning::Machine::level_count; level++) {
      const planning::Machine::Level& from = machine_.levels[level];
      for (size_t s = 0; s < stages_.size(); s++) {
        const Traffic &in = behind_[level - 1][s], &out = behind_[level][s];
        const double serial = std::max(0.0, in.serial_bytes - out.serial_bytes);
        const double parallel = std::max(0.0, in.parallel_bytes - out.parallel_bytes);
        stages_[s].bytes[level] += serial + parallel;
        stages_[s].memory_seconds[level] +=
            (serial / from.one_thread + parallel / from.all_threads) * ns;
      }
    }
  }
};

}  // namespace

double StagePrediction::all_memory_seconds() const {
  return std::accumulate(memory_seconds.begin(), memory_seconds.end(), 0.0);
}

std::string StagePrediction::bound_by() const {
  const double memory = all_memory_seconds();
  if (launch_seconds > std::max(compute_seconds, memory)) return "launch";
  if (compute_seconds >= memory) return "compute";
  static constexpr const char* names[] = {"L1", "L2", "L3", "memory"};
  const auto longest = std::max_element(memory_seconds.begin(), memory_seconds.end());
  return names[longest - memory_seconds.begin()];
}

namespace {

Prediction predict(const Program& program, const planning::Machine& machine, int threads) {
  planning::Machine shared = machine;
  if (threads == 1) {
    for (planning::Machine::Level& level : shared.levels) level.all_threads = level.one_thread;
  }
  return Predictor(program, shared).predict();
}

}  // namespace

Prediction predict(const LoweredFunction& function, const ProgramSizes& sizes,
                   const planning::Machine& machine, int threads) {
  const int used = threads > 0 ? threads : machine.threads;
  return predict(Program(function, sizes, machine, used), machine, used);
}

std::function<double(const planning::Machine&)> seconds_predictor(const LoweredFunction& function,
                                                                  const ProgramSizes& sizes,
                                                                  const planning::Machine& machine,
                                                                  int threads) {
  const int used = threads > 0 ? threads : machine.threads;
  const auto program = std::make_shared<Program>(function, sizes, machine, used);
  return [=](const planning::Machine& m) { return predict(*program, m, used).seconds; };
}

double predicted_seconds(const LoweredFunction& function, const ProgramSizes& sizes,
                         const planning::Machine& machine, int threads) {
  return predict(function, sizes, machine, threads).seconds;
}

}  // namespace retrograde::tuning
