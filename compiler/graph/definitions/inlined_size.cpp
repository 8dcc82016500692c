#include "graph/definitions/inlined_size.h"

#include "graph/definitions/element_values.h"
#include "graph/definitions/own_reads.h"

namespace retrograde::graph {

std::unordered_map<const Symbol*, int> func_calls(const FuncContents& f) {
  std::unordered_map<const Symbol*, int> calls;
  for (int s = 0; s < f.stage_count(); ++s) {
    SeenElements seen;
    walk_definition(f.stage(s), [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (call && call->call_type == CallType::Func && call->symbol.raw() != &f && seen.is_first(e))
        ++calls[call->symbol.raw()];
    });
  }
  return calls;
}

double InlinedSizes::nodes(const FuncContents& f) const {
  double total = 0;
  for (int s = 0; s < f.stage_count(); ++s)
    walk_definition(f.stage(s), [&](const Expr&) { ++total; });
  for (const auto& [callee, calls] : func_calls(f)) total += calls * value_or(nodes_, callee, 0);
  return total;
}

FuncPtr InlinedSizes::largest_part(const FuncContents& f) const {
  const auto calls = func_calls(f);
  FuncPtr result;
  double most = 0;
  for (const FuncPtr& callee : direct_callees(f)) {  // in program order
    const auto found = nodes_.find(callee.get());
    const double part = found == nodes_.end() ? 0 : calls.at(callee.get()) * found->second;
    if (part <= most) continue;
    most = part;
    result = callee;
  }
  return result;
}

}  // namespace retrograde::graph
