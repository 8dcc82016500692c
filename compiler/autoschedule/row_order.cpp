#include "autoschedule/row_order.h"

#include <algorithm>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "autoschedule/machine/reference.h"
#include "autoschedule/only_reader.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

// Which Funcs are loaded from memory, by themselves or by what is inlined into them.
class MemoryLoads {
 public:
  explicit MemoryLoads(const SizeEstimate& sizes) : sizes_(sizes) {}

  bool come_from_memory(const FuncPtr& f) {
    if (sizes_.bytes(*f) < sizes_.machine().last_cache_bytes()) return false;
    if (f->schedule.compute_level.kind != graph::LoopLevel::Kind::Inlined) return true;
    const auto [known, is_new] = by_inlining_.try_emplace(f.get(), false);
    if (!is_new) return known->second;
    bool found = false;
    for (const FuncPtr& callee : direct_callees(*f)) found = found || come_from_memory(callee);
    return by_inlining_[f.get()] = found;
  }

 private:
  const SizeEstimate& sizes_;
  std::unordered_map<const Symbol*, bool> by_inlining_;
};

// Reduction variables that move such loads from plane to plane or from row to row, but none along a
// row.
std::unordered_set<std::string> planes_of(const FuncContents& f, const Definition& update,
                                          MemoryLoads& memory) {
  std::unordered_set<std::string> across, along;
  walk_definition(update, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
    if (!callee || callee.get() == &f || !memory.come_from_memory(callee)) return;
    for (const ReductionVariable& r : update.rvars) {
      for (size_t d = 0; d < call->args.size(); ++d) {
        if (uses_variable(call->args[d], r.var)) (d == 0 ? along : across).insert(r.var);
      }
    }
  });
  for (const std::string& var : along) across.erase(var);
  return across;
}

int64_t iterations_of(const Definition& update, const std::unordered_set<std::string>& vars) {
  int64_t result = 1;
  for (const ReductionVariable& r : update.rvars)
    result *= vars.contains(r.var) ? as_const_int(simplify(r.extent)).value_or(1) : 1;
  return result;
}

// Vectors along the first dimension are all that was cut off, and rows are tasks.
bool runs_row_by_row(const FuncContents& f, const Definition& update) {
  const auto& splits = update.schedule.splits;
  const auto& loops = update.schedule.dims;
  return f.args.size() > 1 && splits.size() == 1 && splits[0].old_var == f.args[0] &&
         splits[0].outer == f.args[0] && is_pure_position(f, update, 0) &&
         !loops.back().is_reduction && loops.back().var != f.args[0];
}

void move_out(const FuncPtr& f, int stage, const std::unordered_set<std::string>& planes) {
  const Definition& update = f->stage(stage);
  std::vector<VarOrRVar> order;
  for (const Dim& loop : update.schedule.dims) {
    if (planes.contains(loop.var)) continue;
    order.push_back(VarOrRVar(loop.var, loop.is_reduction));
    if (loop.var != f->args[0]) continue;
    for (const ReductionVariable& r : update.rvars) {
      if (planes.contains(r.var)) order.push_back(RVar(r.var));
    }
  }
  Stage(f, stage).reorder(order);
}

}  // namespace

void run_along_rows(const std::vector<FuncPtr>& funcs, const SizeEstimate& sizes) {
  MemoryLoads memory(sizes);
  for (const FuncPtr& f : funcs) {
    if (!is_at_root(*f)) continue;
    for (int s = 1; s < f->stage_count(); ++s) {
      const auto planes = planes_of(*f, f->stage(s), memory);
      if (iterations_of(f->stage(s), planes) >= planning::prefetched_streams &&
          runs_row_by_row(*f, f->stage(s)))
        move_out(f, s, planes);
    }
  }
}

}  // namespace retrograde::autoschedule
