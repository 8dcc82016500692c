#include "lower/definitions/value_bounds.h"

#include <unordered_set>

#include "ir/visit.h"

namespace retrograde::lower {
namespace {

// The names that bounds may not mention outside of the definition: coordinates.
std::unordered_set<std::string> coordinates_of(const LoopedFunc& f) {
  std::unordered_set<std::string> names(f.func->args.begin(), f.func->args.end());
  for (const Definition& stage : f.stages) {
    for (const ReductionVariable& r : stage.rvars) names.insert(r.var);
  }
  return names;
}

Interval bounds_of_value(const LoopedFunc& f, size_t value,
                         const std::unordered_set<std::string>& coordinates,
                         const ValueBounds& known) {
  if (f.func->is_extern()) return Interval::everything();
  // If the pure definition is predicated, elements elsewhere may have any value.
  if (f.stages[0].predicate.defined()) return Interval::everything();
  Scope<Interval> anywhere;
  for (const std::string& name : coordinates) anywhere.push(name, Interval::everything());
  Interval result = bounds_of(f.stages[0].values[value], anywhere, &known);
  for (size_t s = 1; s < f.stages.size(); s++)
    result = hull(result, bounds_of(f.stages[s].values[value], anywhere, &known));
  return result;
}

bool is_usable(const Expr& end, const std::unordered_set<std::string>& coordinates) {
  return end.defined() && !uses_any_variable(end, coordinates);
}

}  // namespace

ValueBounds value_bounds(const Program& program) {
  ValueBounds known;
  for (const LoopedFunc& f : program.funcs) {
    const auto coordinates = coordinates_of(f);
    for (size_t value = 0; value < f.func->types.size(); value++) {
      Interval bounds = bounds_of_value(f, value, coordinates, known);
      if (!is_usable(bounds.min, coordinates)) bounds.min = {};
      if (!is_usable(bounds.max, coordinates)) bounds.max = {};
      if (bounds.has_lower_bound() || bounds.has_upper_bound())
        known[{f.name(), static_cast<int>(value)}] = bounds;
    }
  }
  return known;
}

}  // namespace retrograde::lower
