#include "lower/loops/enclosing_conditions.h"

#include <utility>

#include "ir/build.h"

namespace retrograde::lower {

void EnclosingConditions::inside(Binder binder, Body body) {
  binders_.push_back(std::move(binder));
  body();
  binders_.pop_back();
}

void EnclosingConditions::inside_let(const LetStmt& n, Body body) {
  if (uses_any_variable(n.value, varying_)) varying_.insert(n.name);
  if (uses_any_variable(n.value, lanes_)) lanes_.insert(n.name);
  inside({n.name, n.value, {}, {}}, body);
}

void EnclosingConditions::inside_loop(const For& n, Body body) {
  varying_.insert(n.name);
  if (n.runs == ForType::Vectorized) lanes_.insert(n.name);
  kernels_ += is_gpu(n.runs);
  inside({n.name, {}, n.min, n.extent}, body);
  kernels_ -= is_gpu(n.runs);
}

void EnclosingConditions::under(const Expr& condition, AtLoops at_loops, Body body) {
  const bool is_useful = !is_const_true(condition);
  if (is_useful) conditions_.push_back({condition, depth(), at_loops});
  inside_guard(body);
  if (is_useful) conditions_.pop_back();
}

void EnclosingConditions::inside_guard(Body body) {
  guards_++;
  body();
  guards_--;
}

void EnclosingConditions::around_expression(Body body) {
  expression_ = conditions_.size();
  body();
}

void EnclosingConditions::outside_of_choices(Body body) {
  const auto first = conditions_.begin() + static_cast<std::ptrdiff_t>(expression_);
  const std::vector<EnclosingCondition> choices(first, conditions_.end());
  conditions_.erase(first, conditions_.end());
  body();
  conditions_.insert(conditions_.end(), choices.begin(), choices.end());
}

void EnclosingConditions::for_each_since(
    const Depth& outer, FunctionRef<void(const EnclosingCondition&, const Expr&)> visit) const {
  for (size_t i = outer.conditions; i < conditions_.size(); i++) {
    visit(conditions_[i], seen_from(outer, conditions_[i]));
  }
}

Expr EnclosingConditions::seen_from(const Depth& outer, const Expr& condition) const {
  return seen_from(outer, {condition, depth(), AtLoops::Forget});
}

Expr EnclosingConditions::seen_from(const Depth& outer, const EnclosingCondition& enclosing) const {
  Expr condition = enclosing.condition;
  for (size_t i = enclosing.outside.binders; i-- > outer.binders && !is_const_true(condition);)
    condition = from_outside(condition, binders_[i], enclosing.at_loops);
  return condition;
}

}  // namespace retrograde::lower
