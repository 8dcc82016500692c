#include "tuning/explain_stages.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "autoschedule/machine/kept_machine.h"
#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "graph/names.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "tuning/loops_in_words.h"
#include "tuning/predict.h"

namespace retrograde::tuning {

namespace {

// A stage gets hints if it takes at least this share of the time.
constexpr double least_share = 0.05;

std::string bytes_in_words(double bytes) {
  static constexpr std::pair<double, const char*> units[] = {
      {1e9, " GB"}, {1e6, " MB"}, {1e3, " kB"}, {1, " bytes"}};
  const auto* unit = std::ranges::find_if(units, [&](const auto& u) { return bytes >= u.first; });
  const auto& [size, name] = unit == std::end(units) ? units[3] : *unit;
  std::ostringstream out;
  out << std::setprecision(3) << bytes / size << name;
  return out.str();
}

// The predictions of the places at which a Func is computed, added up.
void add(const StagePrediction& more, StagePrediction& sum) {
  sum.seconds += more.seconds;
  sum.compute_seconds += more.compute_seconds;
  sum.launch_seconds += more.launch_seconds;
  sum.chain_seconds += more.chain_seconds;
  sum.element_seconds += more.element_seconds;
  sum.scalar_seconds += more.scalar_seconds;
  sum.one_thread_seconds += more.one_thread_seconds;
  for (size_t level = 0; level < planning::Machine::level_count; level++) {
    sum.bytes[level] += more.bytes[level];
    sum.memory_seconds[level] += more.memory_seconds[level];
  }
}

std::map<std::string, StagePrediction> by_func(const Prediction& prediction,
                                               const std::vector<std::string>& funcs) {
  std::map<std::string, StagePrediction> result;
  for (const StagePrediction& stage : prediction.stages)
    add(stage, result[func_of_stage(stage.name, funcs)]);
  return result;
}

// A read of a Func without the type behind it. Reads of generated Funcs may be long.
std::string read_in_words(const Expr& read) {
  constexpr size_t longest = 60;
  const std::string words = graph::without_numbers(text(read));
  const std::string call = words.substr(0, words.rfind(')') + 1);
  return call.size() > longest ? "elements" : call;
}

// One Func with what is known of it.
class StageExplainer {
 public:
  StageExplainer(const FuncPtr& f, const StagePrediction& time, std::vector<DefinitionLoops> loops)
      : f_(f), time_(time), loops_(std::move(loops)) {}

  ExplainedStage explain(double all_seconds, int threads) {
    ExplainedStage stage;
    stage.name = f_ ? graph::without_numbers(f_->name) : "";
    stage.ms = 1e3 * time_.seconds;
    for (const DefinitionLoops& one : loops_)
      stage.loops.push_back(definition_name(one.stage) + ": " + one.text);
    find_chain();
    stage.bound = bound();
    if (time_.seconds >= least_share * all_seconds) stage.hints = hints(threads);
    return stage;
  }

 private:
  const FuncPtr f_;
  const StagePrediction& time_;
  const std::vector<DefinitionLoops> loops_;
  std::string
      chain_;  // the hint about an update whose iterations depend on each other; empty: none

  std::string definition_name(int stage) const {
    return stage == 0 ? "definition" : "update " + std::to_string(stage - 1);
  }

  // An update that reads other elements of its own Func runs serially. Vectors of independent iterations, or several
  // of them in turn, hide the latency.
  void find_chain() {
    for (const DefinitionLoops& loops : loops_) {
      if (loops.stage == 0 || loops.is_vectorized || loops.is_interleaved ||
          loops.serial_trips <= 1)
        continue;
      const Expr read = graph::read_elsewhere(*f_, f_->stage(loops.stage));
      if (!read.defined()) continue;
      std::ostringstream out;
      out << definition_name(loops.stage) << " reads " << read_in_words(read)
          << " of earlier iterations, so " << std::llround(loops.serial_trips)
          << " iterations run one after the other"
          << (loops.is_parallel
                  ? ". Make the dimension of independent chains the innermost one, so that a "
                    "vector holds several of them"
                  : ", on one thread. Where iterations do not depend on each other, use a Var "
                    "instead of a reduction variable, or one Func per step");
      chain_ = out.str();
      return;
    }
  }

  std::string bound() const {
    const std::string kind = time_.bound_by();
    if (kind == "launch") return "the start of parallel loops";
    if (!chain_.empty()) return "a serial chain";  // whose latency the model does not count
    if (kind != "compute") {
      const double bytes = kind == "memory" ? time_.bytes.back()
                           : kind == "L3"   ? time_.bytes[2]
                                            : time_.bytes[1];
      const std::string from = kind == "memory" ? "memory" : "the " + kind + " cache";
      return "memory traffic, " + bytes_in_words(bytes) + " from " + from;
    }
    if (!chain_.empty() || 2 * time_.chain_seconds > time_.compute_seconds) return "a serial chain";
    if (2 * time_.element_seconds > time_.compute_seconds)
      return "loads and stores of single elements";
    if (2 * time_.scalar_seconds > time_.compute_seconds) return "scalar code";
    return "arithmetic";
  }

  std::vector<std::string> hints(int threads) const {
    std::vector<std::string> result;
    if (!chain_.empty()) result.push_back(chain_);
    if (chain_.empty() && threads > 1 && 2 * time_.one_thread_seconds > time_.seconds)
      result.push_back(
          "no parallel loop: one of " + std::to_string(threads) +
          " threads works. A dimension of independent elements, or a sum split by rfactor, can run "
          "in parallel");
    if (time_.bound_by() == "launch")
      result.push_back(
          "starting threads takes longer than the work: compute it in the loops of its consumer, "
          "or "
          "join small stages");
    if (time_.bound_by() == "compute" && 2 * time_.element_seconds > time_.compute_seconds)
      result.push_back(
          "vectors are loaded or stored element by element, because neighbours along the vector "
          "lie "
          "apart in memory or their indices depend on data. Make the dimension whose neighbours "
          "lie "
          "together the innermost");
    return result;
  }
};

ProgramSizes sizes_for(const ir::LoweredFunction& function, const std::vector<FuncPtr>& scheduled,
                       const std::vector<std::vector<int>>& output_sizes,
                       const std::map<std::string, std::vector<int>>& input_sizes) {
  ProgramSizes sizes = program_sizes(function, output_shapes(scheduled, output_sizes));
  for (const auto& [name, extents] : input_sizes) {
    const auto found = sizes.buffers.find(name);
    if (found == sizes.buffers.end() || found->second.dims.size() != extents.size()) continue;
    int64_t stride = 1;
    for (size_t d = 0; d < extents.size(); d++) {
      found->second.dims[d] = {0, extents[d], stride};
      stride *= extents[d];
    }
  }
  return sizes;
}

bool is_inlined(const FuncContents& f) {
  return f.schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
}

// The Func that an allocation belongs to; "f.1" is the second value of "f".
std::string func_of_memory(const std::string& memory, const std::vector<std::string>& funcs) {
  const std::string name = func_of_stage(memory, funcs);
  const size_t dot = name.rfind('.');
  const bool is_value = std::ranges::find(funcs, name) == funcs.end() && dot != std::string::npos;
  return is_value ? name.substr(0, dot) : name;
}

// Whether the Func only passes on what it reads, as Func(image) does: nothing is recomputed.
bool only_forwards(const FuncContents& f) {
  return std::ranges::all_of(f.pure->values, [](const Expr& value) {
    const Call* call = value.as<Call>();
    return call && (call->call_type == CallType::Image || call->call_type == CallType::Func);
  });
}

void add_storage(const std::vector<FuncPtr>& funcs, const std::vector<FuncPtr>& outputs,
                 const WorkTree& tree, ExplainedPipeline& result) {
  std::map<std::string, double> bytes;
  const std::vector<std::string> names = mapped(funcs, &FuncContents::name);
  for (const WorkTree::Memory& memory : tree.buffers) {
    if (memory.is_allocated) bytes[func_of_memory(memory.name, names)] += memory.bytes;
  }
  for (const FuncPtr& f : funcs) {
    if (std::ranges::find(outputs, f) != outputs.end()) continue;
    const std::string name = graph::without_numbers(f->name);
    if (is_inlined(*f) && f->is_pure()) {
      if (!only_forwards(*f)) result.recomputed.push_back(name);
    } else if (bytes[f->name] > 0) {
      result.stored.push_back({name, bytes[f->name]});
    }
  }
  std::ranges::stable_sort(result.stored, std::greater(), &StoredFunc::bytes);
}

}  // namespace

std::string func_of_stage(std::string stage, const std::vector<std::string>& funcs) {
  const std::string given = stage;
  while (std::ranges::find(funcs, stage) == funcs.end()) {
    const size_t end = stage.rfind('$');
    if (end == std::string::npos || end == 0) return given;
    stage.resize(stage[end - 1] == '.' ? end - 1 : end);
  }
  return stage;
}

ExplainedPipeline explain_stages(const PipelineSpec& pipeline,
                                 const std::vector<FuncPtr>& scheduled, const Target& target,
                                 const std::vector<std::vector<int>>& output_sizes,
                                 const std::map<std::string, std::vector<int>>& input_sizes) {
  lower::LowerOptions lowering;
  lowering.target = target;
  Stmt nests;
  lowering.observe = [&](const std::string& pass, double, const Stmt& after) {
    if (pass == "add_argument_checks") nests = after;
  };
  const ir::LoweredFunction function =
      lower::lower(pipeline.name, scheduled, lower::infer_arguments(pipeline.outputs), lowering);
  const ProgramSizes sizes = sizes_for(function, scheduled, output_sizes, input_sizes);
  const planning::Machine machine = planning::machine_for(target);
  const Prediction prediction = predict(function, sizes, machine);
  auto loops = loops_in_words(nests, scheduled, sizes);

  ExplainedPipeline result{machine.name, machine.threads, 1e3 * prediction.seconds, {}, {}, {}};
  const std::vector<FuncPtr> funcs = graph::topological_order(scheduled);
  const std::vector<std::string> names = mapped(funcs, &FuncContents::name);
  for (const auto& [name, time] : by_func(prediction, names)) {
    const FuncPtr* f =
        ir::first_where(funcs, [&](const FuncPtr& one) { return one->name == name; });
    if (!f) continue;  // checks of arguments
    result.stages.push_back(StageExplainer(*f, time, std::move(loops[name]))
                                .explain(prediction.seconds, machine.threads));
  }
  std::ranges::stable_sort(result.stages, std::greater(), &ExplainedStage::ms);
  add_storage(
      funcs, scheduled,
      work_tree(function, sizes, {machine.vector_bytes, machine.registers, machine.threads}),
      result);
  return result;
}

}  // namespace retrograde::tuning
