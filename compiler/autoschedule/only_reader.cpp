#include "autoschedule/only_reader.h"

#include <algorithm>

#include "graph/definitions/own_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

Readers::Readers(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored) {
  for (const FuncPtr& f : outputs) outputs_.insert(f.get());
  for (const FuncPtr& f : stored) stored_.insert(f.get());
  for (const FuncPtr& f : topological_order(outputs)) {
    for (const FuncPtr& callee : direct_callees(*f)) readers_[callee.get()].push_back(f);
    const bool is_block = f->made && f->made->blocks > 0;  // see root_loops.cpp
    for (const graph::LoopLevel& level : {f->schedule.compute_level, f->schedule.store_level}) {
      if (level.kind == graph::LoopLevel::Kind::At && !is_block) hosts_.insert(level.func);
    }
  }
}

std::optional<Reader> Readers::only_reader(const FuncPtr& f) const {
  const auto found = readers_.find(f.get());
  if (found == readers_.end() || found->second.size() != 1 || !is_inside(found->second[0]))
    return std::nullopt;
  Reader reader{found->second[0], -1, {}};
  for (int s = 0; s < reader.func->stage_count(); ++s) {
    std::vector<const Call*> reads;
    walk_definition(reader.func->stage(s), [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (call && call->call_type == CallType::Func && call->symbol.raw() == f.get())
        reads.push_back(call);
    });
    if (reads.empty()) continue;
    if (reader.stage >= 0) return std::nullopt;
    reader.stage = s;
    reader.reads = std::move(reads);
  }
  return reader.stage >= 0 ? std::optional(std::move(reader)) : std::nullopt;
}

bool is_at_root(const FuncContents& f) {
  return f.schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
}

bool has_plain_rows(const FuncContents& f) {
  const StageLoops& loops = f.pure->schedule;
  return f.is_pure() && !f.is_extern() && f.args.size() > 1 && loops.splits.size() == 1 &&
         loops.splits[0].old_var == f.args[0] && loops.splits[0].outer == f.args[0];
}

bool is_split(const Definition& stage, const std::string& var) {
  const auto& splits = stage.schedule.splits;
  return std::any_of(splits.begin(), splits.end(), [&](const Split& split) {
    return split.old_var == var || split.outer == var || split.inner == var;
  });
}

}  // namespace retrograde::autoschedule
