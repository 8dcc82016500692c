#include "lower/nests/inline_functions.h"

#include <algorithm>
#include <functional>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/inlined_size.h"
#include "graph/wrappers.h"
#include "ir/visit.h"
#include "lower/nests/fused_groups.h"
#include "lower/nests/refuse_unsupported.h"
#include "lower/nests/resolve_undef.h"
#include "lower/nests/strict_indices.h"

namespace retrograde::ir {

std::string value_buffer_name(const FuncContents& f, int index) {
  return f.types.size() == 1 ? f.name : f.name + "." + std::to_string(index);
}

bool is_hoisted(const LoopedFunc& f) {
  const LoopLevel& hoist = f.schedule.hoist_level;
  const LoopLevel& store = f.schedule.store_level.kind == LoopLevel::Kind::Inlined
                               ? f.schedule.compute_level
                               : f.schedule.store_level;
  if (f.is_output || hoist.kind == LoopLevel::Kind::Inlined) return false;
  return hoist.kind != store.kind || hoist.func != store.func || hoist.var != store.var;
}

std::string place_name(const std::string& func) { return func + ".place"; }

std::string stage_prefix(const std::string& func, int stage) {
  return func + ".s" + std::to_string(stage) + ".";
}

namespace {

struct InlinedFunc {
  std::vector<std::string> args;
  std::vector<Expr> values;
};
using InlinedFuncs = std::unordered_map<const Symbol*, InlinedFunc>;

class Inliner : public Rewriter {
 public:
  explicit Inliner(const InlinedFuncs& inlined) : inlined_(inlined) {}

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    Expr result = children(e);
    const Call* call = result.as<Call>();
    if (!call || call->call_type != CallType::Func) return result;
    auto it = inlined_.find(call->symbol.raw());
    return it == inlined_.end() ? result : value_at(it->second, *call);
  }

 private:
  static Expr value_at(const InlinedFunc& f, const Call& call) {
    RETROGRADE_ASSERT(call.args.size() == f.args.size(), "call with a wrong number of arguments");
    Substitution at_point;
    for (size_t i = 0; i < f.args.size(); i++) at_point[f.args[i]] = call.args[i];
    return substitute(f.values[call.component], at_point);
  }

  const InlinedFuncs& inlined_;
};

bool is_inlined(const FuncContents& f, const FuncPlacement& schedule, bool is_output) {
  return !is_output && f.is_pure() && schedule.compute_level.kind == LoopLevel::Kind::Inlined;
}

// Nodes of an expression beyond which no code generator ends within minutes.
constexpr double most_nodes = 200000;

double distinct_nodes(const std::vector<Expr>& values) {
  std::unordered_set<const ExprNode*> seen;
  for (const Expr& value : values)
    walk(value, [&](const Expr& e) { return seen.insert(e.get()).second; });
  return static_cast<double>(seen.size());
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

}  // namespace

Program inline_functions(const std::vector<FuncPtr>& unwrapped) {
  const std::vector<FuncPtr> outputs = apply_wrappers(unwrapped);
  Program program;
  InlinedFuncs inlined;
  Inliner inliner(inlined);
  InlinedSizes sizes;
  for (const FuncPtr& f : topological_order(outputs)) {
    bool is_output = std::find(outputs.begin(), outputs.end(), f) != outputs.end();
    check_size(*f, sizes);
    std::vector<Definition> stages;
    for (int i = 0; i < f->stage_count(); i++)
      stages.push_back(map_exprs(f->stage(i), std::ref(inliner)));
    if (is_inlined(*f, f->schedule, is_output)) {
      check_inlined(*f, f->schedule);
      inlined[f.get()] = {f->args, stages[0].values};
      sizes.inline_calls_of(*f, distinct_nodes(stages[0].values));
      continue;
    }
    program.index_of[f->name] = static_cast<int>(program.funcs.size());
    program.funcs.push_back({f, f->schedule, std::move(stages), is_output});
  }
  resolve_outermost_levels(program);
  refuse_unsupported(program);
  order_fused_groups(program);
  resolve_undef(program);
  make_indices_strict(program);
  return program;
}

}  // namespace retrograde::ir
