#include "lower/device/kernel_loops.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"

namespace retrograde::lower {

namespace {

struct LoopsOfStage {
  std::string stage;
  std::vector<std::string> blocks, threads;

  std::string to_string() const {
    std::string result = stage + ":";
    const auto list = [&](const char* what, const std::vector<std::string>& loops) {
      if (loops.empty()) return;
      result += (result.back() == ':' ? " " : ", ") + std::string(what) + " ";
      for (size_t i = 0; i < loops.size(); ++i) result += (i ? ", " : "") + loops[i];
    };
    list("blocks", blocks);
    list("threads", threads);
    return result;
  }
};

std::string stage_of(const LoopName& loop) {
  if (loop.stage == "0") return loop.func;
  return text(loop.func, ".update(", std::stoi(loop.stage) - 1, ")");
}

KernelLoops loops_of(const For& outermost) {
  std::vector<LoopsOfStage> stages;
  walk(Stmt(&outermost), [&](const For& loop) {
    const bool is_block = loop.runs == ForType::GpuBlock;
    if (!is_block && !is_gpu_thread(loop.runs)) return;
    const LoopName name = decode_loop_name(loop.name);
    auto at = std::ranges::find(stages, stage_of(name), &LoopsOfStage::stage);
    if (at == stages.end()) at = stages.insert(at, LoopsOfStage{stage_of(name), {}, {}});
    auto& loops = is_block ? at->blocks : at->threads;
    // Branches may repeat the loops of a stage.
    if (std::ranges::find(loops, name.var) == loops.end()) loops.push_back(name.var);
  });
  return mapped(stages, &LoopsOfStage::to_string);
}

void collect(const Stmt& s, std::vector<KernelLoops>& found) {
  if (const auto* loop = s.as<For>(); loop && loop->runs == ForType::GpuBlock)
    return found.push_back(loops_of(*loop));
  for_each_child(
      s, [](const Expr&) {}, [&](const Stmt& part) { collect(part, found); });
}

}  // namespace

// Launches appear in the order of the loops that they were made from.
std::map<std::string, KernelLoops> loops_of_kernels(const Stmt& before, const Stmt& after) {
  std::vector<KernelLoops> loops;
  collect(before, loops);
  std::map<std::string, KernelLoops> by_name;
  size_t number = 0;
  walk(after, [&](const Launch& launch) { by_name[launch.name] = loops.at(number++); });
  return by_name;
}

}  // namespace retrograde::lower
