#include "autoschedule/inlined_reads.h"

#include <algorithm>
#include <functional>

#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int most_calls = 64;  // each makes a copy of a body

class Inliner {
 public:
  explicit Inliner(const std::vector<FuncPtr>& stored) : stored_(stored) {}

  Expr operator()(const Expr& root) {
    return rewrite(without_lets(root),
                   [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
                     const Expr mapped = map_children(e, recurse);
                     const auto* call = mapped.as<Call>();
                     const FuncPtr callee = call ? inlined(*call) : nullptr;
                     return callee && room_-- > 0 ? (*this)(value_of(*callee, *call)) : mapped;
                   });
  }

 private:
  FuncPtr inlined(const Call& call) const {
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    return callee && is_computed_inline(callee, stored_) ? callee : nullptr;
  }
  static Expr value_of(const FuncContents& callee, const Call& call) {
    Substitution args;
    for (size_t d = 0; d < call.args.size(); ++d) args[callee.args[d]] = call.args[d];
    return substitute(without_lets(callee.pure->values[static_cast<size_t>(call.component)]), args);
  }

  const std::vector<FuncPtr>& stored_;
  int room_ = most_calls;
};

}  // namespace

bool is_computed_inline(const FuncPtr& f, const std::vector<FuncPtr>& stored) {
  return f->is_pure() && !f->is_extern() &&
         f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined &&
         std::find(stored.begin(), stored.end(), f) == stored.end();
}

std::vector<Expr> roots_with_inlined(const Definition& stage, const std::vector<FuncPtr>& stored) {
  Inliner inliner(stored);
  std::vector<Expr> roots;
  for_each_expr(stage, [&](const Expr& root) { roots.push_back(inliner(root)); });
  return roots;
}

}  // namespace retrograde::autoschedule
