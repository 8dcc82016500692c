#include "transform/coarse_axis.h"

#include <algorithm>

#include "graph/definitions/reduction_domain.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

namespace {

// How many elements of the stage an element of the grid stands for, at least.
constexpr double least_ratio = 3;

// Indices that depend on data. A remainder selects a phase, the weights of which are no grid.
bool is_other_index(const Expr& e) {
  return any_node(e, [](const Expr& node) {
    const auto* v = node.as<Variable>();
    return is_element_read(node) || node.kind() == Kind::Mod ||
           (v && v->symbol.defined() && !domain_of(*v));
  });
}

}  // namespace

std::optional<double> extent_of(const Interval& range) {
  if (!range.is_bounded()) return std::nullopt;
  const auto min = as_const_int(range.min), max = as_const_int(range.max);
  if (!min || !max) return std::nullopt;
  return std::max(static_cast<double>(*max) - static_cast<double>(*min) + 1, 0.0);
}

bool is_element_read(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
}

CoarseAxis::CoarseAxis(std::string variable, const std::vector<std::string>& pure,
                       const VariableRanges& ranges)
    : variable_(std::move(variable)), pure_(pure), ranges_(ranges) {}

Interval CoarseAxis::range_of(const Expr& index) const {
  analysis::Scope<Interval> scope;
  for (const auto& [name, range] : ranges_) scope.push(name, range);
  return constant_ends(analysis::bounds_of(index, scope));
}

bool CoarseAxis::is_index(const Expr& e) {
  if (e.type() != Int(32) || !uses_variable(e, variable_)) return false;
  const bool is_of_others = std::ranges::any_of(
      pure_, [&](const std::string& name) { return name != variable_ && uses_variable(e, name); });
  if (is_of_others || is_other_index(e)) return false;
  const auto fine = extent_of(ranges_.at(variable_)), coarse = extent_of(range_of(e));
  return fine && coarse && *coarse * least_ratio <= *fine;
}

CoarseAxis::Dependence CoarseAxis::of_call(const Call& call) {
  Dependence result;
  for (const Expr& arg : call.args) {
    if (!uses_variable(arg, variable_)) continue;
    const bool is_other = result.index.defined() && !equal(result.index, arg);
    if (is_other || !is_index(arg)) return {.is_fine = true, .index = {}};
    result.index = arg;
  }
  return result;
}

CoarseAxis::Dependence CoarseAxis::of(const Expr& e) {
  return known_.get(e, [&]() -> Dependence {
    if (const auto* v = e.as<Variable>()) return {.is_fine = v->name == variable_, .index = {}};
    if (is_element_read(e)) return of_call(*e.as<Call>());
    Dependence result;
    for_each_child(e, [&](const Expr& child) {
      const Dependence part = of(child);
      const bool is_other =
          part.index.defined() && result.index.defined() && !equal(part.index, result.index);
      result.is_fine |= part.is_fine || is_other;
      if (part.index.defined()) result.index = part.index;
    });
    return result;
  });
}

Expr CoarseAxis::over_grid(const Expr& e, const Expr& index) const {
  const Expr coordinate = ir::variable(variable_);
  return rewrite(e, [&](const Expr& node, const auto&) -> Expr {
    return equal(node, index) ? coordinate : Expr();
  });
}

}  // namespace retrograde::transform
