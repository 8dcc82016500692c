#include "autodiff/borders/border_conditions.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "analysis/linear.h"
#include "autodiff/sums/accumulation.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {
constexpr double stencil_reach = 64;
}

bool is_range_condition(const Expr& e) {
  bool result = true;
  walk(e, [&](const Expr& node) {
    Kind k = node.kind();
    bool ordered =
        k == Kind::LT || k == Kind::LE || k == Kind::GT || k == Kind::GE || k == Kind::And;
    bool arithmetic =
        k == Kind::Add || k == Kind::Sub || k == Kind::Mul || k == Kind::Min || k == Kind::Max;
    result &= ordered || arithmetic || as_op(node, Op::likely) || k == Kind::Variable ||
              k == Kind::IntImm;
    return result;
  });
  return result;
}

bool fails_in_a_border(const Expr& condition, const std::vector<ReductionVariable>& rvars) {
  if (!is_range_condition(condition)) return false;
  return std::ranges::all_of(rvars, [&](const ReductionVariable& r) {
    auto extent = as_const_int(r.extent);
    return !uses_variable(condition, r.var) ||
           (extent && static_cast<double>(*extent) <= stencil_reach);
  });
}

bool has_borders(const Gather& g) {
  if (!g.rdom || g.scatters || !g.predicate.defined()) return false;
  double iterations = 1;
  for (const ReductionVariable& r : g.rdom->vars)
    iterations *= static_cast<double>(as_const_int(r.extent).value_or(many_terms));
  std::vector<Expr> conditions;
  add_conjuncts(g.predicate, conditions);
  return iterations < many_terms && std::ranges::all_of(conditions, [&](const Expr& e) {
           return fails_in_a_border(e, g.rdom->vars);
         });
}

Expr with_likely_parts(const Expr& predicate, const std::vector<ReductionVariable>& rvars) {
  if (const auto* both = predicate.as<And>())
    return with_likely_parts(both->a, rvars) && with_likely_parts(both->b, rvars);
  return fails_in_a_border(predicate, rvars) ? likely(predicate) : predicate;
}

bool holds_in_a_border(const Expr& predicate, const std::vector<LoopVariable>& region) {
  std::vector<Expr> conditions;
  add_conjuncts(predicate, conditions);
  return std::ranges::any_of(region, [&](const LoopVariable& v) {
    std::optional<int64_t> min, max;
    for (const Expr& condition : conditions) {
      const auto sum = analysis::nonnegative_where(condition);
      const int64_t factor = sum && sum->terms.size() == 1 ? sum->factor_of(v.name) : 0;
      if (factor == 1) min = std::max(min.value_or(INT64_MIN), -sum->constant);
      if (factor == -1) max = std::min(max.value_or(INT64_MAX), sum->constant);
    }
    if (!min || !max || *max - *min + 1 > static_cast<int64_t>(stencil_reach)) return false;
    const auto extent = constant_extent(v.range());
    return !extent || *extent > 2 * (*max - *min + 1);
  });
}

Expr masked(const Expr& predicate, const Expr& value) {
  if (!predicate.defined()) return value;
  Expr condition = is_range_condition(predicate) ? likely(predicate) : predicate;
  return make_select(condition, value, make_zero(value.type()));
}

}  // namespace retrograde::autodiff
