#include "gradient/adversary/schedule_rules.h"

#include <algorithm>
#include <variant>

#include "graph/definitions/own_reads.h"
#include "ir/memory_reads.h"

namespace retrograde::gradient {

namespace {

using graph::Definition;
using graph::FuncContents;
using graph::FuncPtr;
using graph::LoopLevel;

bool scatters(const FuncContents& f) {
  return std::any_of(f.updates.begin(), f.updates.end(), [](const Definition& update) {
    return std::any_of(update.args.begin(), update.args.end(), [](const Expr& place) {
      return ir::reads_memory(place, ir::MemoryReads::Functions);
    });
  });
}

bool scans(const FuncContents& f) {
  return std::any_of(f.updates.begin(), f.updates.end(), [&](const Definition& update) {
    return graph::read_elsewhere(f, update).defined();
  });
}

bool is_inner_of_split(const Definition& stage, const std::string& loop) {
  const auto& splits = stage.schedule.splits;
  return std::any_of(splits.begin(), splits.end(),
                     [&](const graph::Split& split) { return split.inner == loop; });
}

class RulesSeen {
 public:
  explicit RulesSeen(const std::vector<FuncPtr>& outputs)
      : order_(graph::topological_order(outputs)) {}

  std::set<std::string> find() {
    for (const FuncPtr& f : order_) {
      note_func(*f);
      if (f->schedule.compute_level.kind == LoopLevel::Kind::At) note_place(*f);
      for (int s = 0; s < f->stage_count(); ++s) note_stage(*f, s);
    }
    return seen_;
  }

 private:
  const FuncPtr* func_named(const std::string& name) const {
    const auto found = std::find_if(order_.begin(), order_.end(),
                                    [&](const FuncPtr& f) { return f->name == name; });
    return found == order_.end() ? nullptr : &*found;
  }

  void note_func(const FuncContents& f) {
    if (f.made && f.made->has_parts) seen_.insert("private parts");
    if (f.made && f.made->lanes > 0) seen_.insert("private lanes");
    for (const graph::LoggedDirective& given : f.log) {
      if (std::holds_alternative<graph::FactorOut>(given.directive)) seen_.insert("cut sums");
      if (std::holds_alternative<graph::ComputeWith>(given.directive))
        seen_.insert("joined sweeps");
      if (std::holds_alternative<graph::AllowRaces>(given.directive))
        seen_.insert("scatters in vectors of iterations");
      if (std::holds_alternative<graph::Wrap>(given.directive)) seen_.insert("packed operands");
      if (std::holds_alternative<graph::ReorderStorage>(given.directive))
        seen_.insert(scatters(f) ? "scatters in lanes" : "other layouts");
    }
  }

  void note_place(const FuncContents& f) {
    const LoopLevel& level = f.schedule.compute_level;
    const FuncPtr* host = func_named(level.func);
    if (f.schedule.store_level != level) {
      seen_.insert("strips");
    } else if (f.made && f.made->blocks > 0) {
      seen_.insert("blocks of sums");
    } else if (scatters(f)) {
      seen_.insert("slices of scatters");
    } else if (scans(f)) {
      seen_.insert("blocks of columns");
    } else if (host && is_of_reduction(**host, level)) {
      seen_.insert("slices of reductions");
    } else {
      seen_.insert("slices");
    }
  }
  static bool is_of_reduction(const FuncContents& host, const LoopLevel& level) {
    for (int s = std::max(level.stage, 0); s < host.stage_count(); ++s) {
      for (const graph::Dim& loop : host.stage(s).schedule.dims) {
        if (loop.var == level.var) return loop.is_reduction;
      }
    }
    return false;
  }

  void note_stage(const FuncContents& f, int s) {
    const Definition& stage = f.stage(s);
    if (f.is_extern()) return;
    const auto& loops = stage.schedule.dims;
    bool unrolls = false;
    for (const graph::Dim& loop : loops) {
      if (loop.runs == ForType::Parallel) seen_.insert("tasks");
      if (loop.runs != ForType::Unrolled) continue;
      unrolls = true;
      const bool is_part = is_inner_of_split(stage, loop.var);
      seen_.insert(loop.is_reduction     ? is_part ? "planes of sums" : "taps"
                   : stage.rvars.empty() ? "planes"
                                         : "register tiles");
    }
    const auto& splits = stage.schedule.splits;
    if (splits.size() == 2 && stage.rvars.empty() && !unrolls &&
        splits[0].old_var != splits[1].old_var)
      seen_.insert("square tiles");
    if (splits.size() == 2 && scans(f) && s > 0 && splits[0].inner == splits[1].old_var)
      seen_.insert("scans of columns");
    if (splits.size() == 1 && s > 0 && !f.args.empty() && runs_inside(loops, f.args[0]))
      seen_.insert("sums along rows");
  }
  // Whether the loop over the variable is inside of a reduction loop.
  static bool runs_inside(const std::vector<graph::Dim>& loops, const std::string& var) {
    bool is_inside = false;
    for (const graph::Dim& loop : loops) {
      if (is_inside && loop.is_reduction) return true;
      is_inside |= loop.var == var;
    }
    return false;
  }

  const std::vector<FuncPtr> order_;
  std::set<std::string> seen_;
};

}  // namespace

std::set<std::string> rules_seen_in(const std::vector<FuncPtr>& outputs) {
  return RulesSeen(outputs).find();
}

}  // namespace retrograde::gradient
