#include "graph/definitions/element_values.h"

#include <algorithm>
#include <functional>

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/equal.h"

namespace retrograde::graph {

namespace {

// Calls of the values of one element lie together, so that a few are enough.
constexpr size_t most_recent_elements = 16;

}  // namespace

Substitution ElementValues::substitution_to(const std::vector<Expr>& element) const {
  RETROGRADE_ASSERT(element.size() == args_.size(), "call with a wrong number of arguments");
  Substitution result;
  for (size_t d = 0; d < args_.size(); ++d) result[args_[d]] = element[d];
  return result;
}

Expr ElementValues::at(const std::vector<Expr>& element, int component) {
  const Expr& value = values_[static_cast<size_t>(component)];
  const auto known = std::ranges::find_if(
      recent_, [&](const Element& other) { return same_args(other.place, element); });
  if (known != recent_.end()) return (*known->values)(value);
  if (recent_.size() == most_recent_elements) recent_.pop_front();
  const auto step = [map = substitution_to(element)](const Expr& e, const auto&) -> Expr {
    const auto* var = e.as<Variable>();
    return var ? value_or(map, var->name, {}) : Expr();
  };
  recent_.push_back({element, std::make_unique<StepRewriter>(step)});
  return (*recent_.back().values)(value);
}

bool SeenElements::is_first(const Expr& e) {
  const auto& call = *e.as<Call>();
  size_t key = std::hash<const Symbol*>()(call.symbol.raw());
  for (const Expr& arg : call.args) key = key * 31 + hash(arg);
  std::vector<Expr>& calls = calls_[key];
  const bool is_known = std::ranges::any_of(calls, [&](const Expr& seen) {
    const auto& other = *seen.as<Call>();
    return other.symbol.raw() == call.symbol.raw() && same_args(other.args, call.args);
  });
  if (!is_known) calls.push_back(e);
  return !is_known;
}

}  // namespace retrograde::graph
