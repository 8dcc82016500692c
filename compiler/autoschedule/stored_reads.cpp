#include "autoschedule/stored_reads.h"

#include <algorithm>

#include "autoschedule/inlined_reads.h"
#include "ir/walk_once.h"

namespace retrograde::autoschedule {

StoredReads::StoredReads(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored) {
  for (const FuncPtr& f : topological_order(outputs)) {
    const bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    if (is_computed_inline(f, stored) && !is_output) continue;
    if (f->is_extern()) hide(f, stored);
    for (int s = 0; s < f->stage_count(); ++s) note(f, s, stored);
  }
}

const std::vector<StoredRead>& StoredReads::of(const FuncPtr& f) const {
  static const std::vector<StoredRead> none;
  const auto found = reads_.find(f.get());
  return found == reads_.end() ? none : found->second;
}

void StoredReads::note(const FuncPtr& f, int stage, const std::vector<FuncPtr>& stored) {
  NodeSet visited;
  const std::vector<Expr> roots = roots_with_inlined(f->stage(stage), stored);
  for (const Expr& root : roots) {
    walk_once(root, visited, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
      if (!callee || callee == f) return true;
      if (is_computed_inline(callee, stored))
        hide(callee, stored);
      else
        add(callee, f, stage, e);
      return true;
    });
  }
}

void StoredReads::add(const FuncPtr& callee, const FuncPtr& reader, int stage, const Expr& call) {
  std::vector<StoredRead>& all = reads_[callee.get()];
  if (all.empty() || all.back().reader != reader || all.back().stage != stage)
    all.push_back({reader, stage, {}});
  all.back().calls.push_back(call);
}

void StoredReads::hide(const FuncPtr& inlined, const std::vector<FuncPtr>& stored) {
  for (const FuncPtr& callee : direct_callees(*inlined)) {
    if (hidden_.insert(callee.get()).second && is_computed_inline(callee, stored))
      hide(callee, stored);
  }
}

}  // namespace retrograde::autoschedule
