#include "lower/storage/memory_order.h"

#include "graph/computing_order.h"
#include "lower/checks/fusing_checks.h"

namespace retrograde::lower {

namespace {

std::optional<size_t> host_of(const Program& program, const LoopedFunc& f) {
  const graph::LoopLevel& level = f.schedule.compute_level;
  const auto host = program.index_of.find(level.func);
  if (level.kind != graph::LoopLevel::Kind::At || host == program.index_of.end()) return {};
  return static_cast<size_t>(host->second);
}

}  // namespace

void order_for_memory(Program& program) {
  std::vector<graph::ComputedFunc> funcs;
  for (size_t f = 0; f < program.funcs.size(); ++f) {
    const LoopedFunc& looped = program.funcs[f];
    const std::vector<int> callees = callees_of(program, static_cast<int>(f));
    funcs.push_back({{callees.begin(), callees.end()},
                     host_of(program, looped),
                     looped.func->args.size(),
                     looped.is_output});
  }
  std::vector<LoopedFunc> ordered;
  for (const size_t f : graph::computing_order(funcs))
    ordered.push_back(std::move(program.funcs[f]));
  program.funcs = std::move(ordered);
  program.number();
}

}  // namespace retrograde::lower
