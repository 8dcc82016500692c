#include "lower/definitions/inline_functions.h"

#include <algorithm>
#include <functional>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/element_values.h"
#include "graph/definitions/inlined_size.h"
#include "graph/directives/wrappers.h"
#include "ir/walk_once.h"
#include "lower/checks/refuse_unsupported.h"
#include "lower/definitions/likely_clamps.h"
#include "lower/definitions/resolve_undef.h"
#include "lower/definitions/strict_indices.h"
#include "lower/nests/fused_groups.h"
#include "lower/storage/memory_order.h"

namespace retrograde::lower {

namespace {

using InlinedFuncs = std::unordered_map<const Symbol*, ElementValues>;

bool is_inlined(const FuncContents& f, const FuncPlacement& schedule, bool is_output) {
  return !is_output && f.is_pure() && schedule.compute_level.kind == LoopLevel::Kind::Inlined;
}

// The number of nodes of an expression above which code generation would take more than minutes.
constexpr double most_nodes = 200000;

double distinct_nodes(const std::vector<Expr>& values) {
  double nodes = 0;
  NodeSet visited;
  for (const Expr& value : values)
    walk_once(value, visited, [&](const Expr&) { return ++nodes, true; });
  return nodes;
}

void check_size(const FuncContents& f, const InlinedSizes& sizes) {
  const double nodes = sizes.nodes(f);
  const FuncPtr part = nodes > most_nodes ? sizes.largest_part(f) : nullptr;
  if (!part) return;
  user_error(
      text("inline ", quoted(part->name), " into ", quoted(f.name)),
      "what is inlined makes an expression that a code generator finishes",
      text("it is called ", func_calls(f).at(part.get()), " times, and the expression would have ",
           static_cast<int64_t>(nodes), " nodes, more than ", static_cast<int64_t>(most_nodes)),
      text("Compute ", quoted(part->name),
           ", or a Func that it reads, at root or at a loop of its consumer"));
}

// A C function gets each of its buffers as one box. The storage of a Func is one box only at its compute level, so the
// store level of such Funcs is set to it; the values are the same.
void store_with_extern_stages(Program& program) {
  std::unordered_set<const FuncContents*> boxes;
  for (const LoopedFunc& f : program.funcs) {
    if (!f.func->is_extern()) continue;
    boxes.insert(f.func.get());
    for (const ExternArgument& arg : f.func->extern_definition->args) {
      if (arg.kind == ExternArgument::Kind::Func) boxes.insert(arg.func.get());
    }
  }
  for (LoopedFunc& f : program.funcs) {
    if (!boxes.contains(f.func.get()) || f.is_output) continue;
    f.schedule.store_level = f.schedule.compute_level;
    f.schedule.hoist_level = f.schedule.compute_level;
  }
}

}  // namespace

Program inline_functions(const std::vector<FuncPtr>& unwrapped) {
  const std::vector<FuncPtr> outputs = apply_wrappers(unwrapped);
  Program program;
  InlinedFuncs inlined;
  StepRewriter inliner([&](const Expr& e, const auto& recurse) -> Expr {
    const Call* call = e.as<Call>();
    if (!call || call->call_type != CallType::Func) return {};
    const Expr mapped = map_children(e, recurse);
    const auto it = inlined.find(call->symbol.raw());
    return it == inlined.end() ? mapped : it->second.at(mapped.as<Call>()->args, call->component);
  });
  InlinedSizes sizes;
  for (const FuncPtr& f : topological_order(outputs)) {
    bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    check_size(*f, sizes);
    std::vector<Definition> stages = numbered(
        f->stage_count(), [&](int i) { return map_exprs(f->stage(i), std::ref(inliner)); });
    if (is_inlined(*f, f->schedule, is_output)) {
      check_inlined(*f, f->schedule);
      inlined.emplace(f.get(), ElementValues(f->args, stages[0].values));
      sizes.inline_calls_of(*f, distinct_nodes(stages[0].values));
      continue;
    }
    program.index_of[f->name] = static_cast<int>(program.funcs.size());
    program.funcs.push_back({f, f->schedule, std::move(stages), is_output});
  }
  store_with_extern_stages(program);
  resolve_outermost_levels(program);
  refuse_unsupported(program);
  order_for_memory(program);
  order_fused_groups(program);
  resolve_undef(program);
  make_indices_strict(program);
  mark_likely_clamps(program);
  return program;
}

}  // namespace retrograde::lower
