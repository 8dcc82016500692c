#include "autoschedule/inlined_reads.h"

#include <algorithm>
#include <functional>
#include <unordered_map>
#include <utility>

#include "graph/definitions/element_values.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/walk_once.h"

namespace retrograde::autoschedule {

namespace {

constexpr int most_calls = 64;  // each makes a copy of a body

class Inliner {
 public:
  explicit Inliner(const std::vector<FuncPtr>& stored) : stored_(stored) {}

  // Returns the same handles if nothing changes, as in most stages.
  std::vector<Expr> operator()(const std::vector<Expr>& roots) {
    bool has_lets = false, has_calls = false;
    NodeSet visited;
    for (const Expr& root : roots) {
      walk_once(root, visited, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        has_lets |= e.kind() == Kind::Let;
        has_calls |= call && inlined_callee(*call);
        return !has_lets || !has_calls;
      });
    }
    const auto plain = [&](const Expr& root) { return has_lets ? without_lets(root) : root; };
    return has_calls ? mapped(roots, [&](const Expr& root) { return inlined_(plain(root)); })
                     : mapped(roots, plain);
  }

 private:
  // Null: it stays a call.
  FuncPtr inlined_callee(const Call& call) const {
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    return callee && is_computed_inline(callee, stored_) ? callee : nullptr;
  }

  Expr inlined(const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
    const Expr mapped = map_children(e, recurse);
    const auto* call = mapped.as<Call>();
    const FuncPtr callee = call ? inlined_callee(*call) : nullptr;
    if (!callee || room_ <= 0) return mapped;
    if (seen_.is_first(mapped)) --room_;
    return recurse(values_of(*callee).at(call->args, call->component));
  }

  ElementValues& values_of(const FuncContents& f) {
    const auto found = values_.find(&f);
    if (found != values_.end()) return found->second;
    std::vector<Expr> values;
    for (const Expr& value : f.pure->values) values.push_back(without_lets(value));
    return values_.emplace(&f, ElementValues(f.args, std::move(values))).first->second;
  }

  const std::vector<FuncPtr>& stored_;
  std::unordered_map<const FuncContents*, ElementValues> values_;
  SeenElements seen_;
  int room_ = most_calls;
  StepRewriter inlined_{
      [this](const Expr& e, const auto& recurse) -> Expr { return inlined(e, recurse); }};
};

}  // namespace

bool is_computed_inline(const FuncPtr& f, const std::vector<FuncPtr>& stored) {
  return f->is_pure() && !f->is_extern() &&
         f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined &&
         std::find(stored.begin(), stored.end(), f) == stored.end();
}

std::vector<Expr> roots_with_inlined(const Definition& stage, const std::vector<FuncPtr>& stored) {
  std::vector<Expr> roots;
  for_each_expr(stage, [&](const Expr& root) { roots.push_back(root); });
  return Inliner(stored)(roots);
}

}  // namespace retrograde::autoschedule
