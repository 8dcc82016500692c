#include "frontend/data/argument.h"

#include "diagnostics/error.h"
#include "ir/equal.h"
#include "ir/scalar.h"

namespace retrograde {
namespace {

bool same(const Expr& a, const Expr& b) {
  return a.defined() && b.defined() ? ir::equal(a, b) : a.defined() == b.defined();
}

bool same(const Region& a, const Region& b) {
  if (a.size() != b.size()) return false;
  for (size_t d = 0; d < a.size(); d++) {
    if (!same(a[d].min, b[d].min) || !same(a[d].extent, b[d].extent)) return false;
  }
  return true;
}

// Empty unless every dimension has an estimate.
Region estimated_region(const graph::ParameterContents& parameter) {
  Region region;
  for (const graph::BufferConstraint& dim : parameter.constraints) {
    if (!dim.min_estimate.defined() || !dim.extent_estimate.defined()) return {};
    region.push_back({dim.min_estimate, dim.extent_estimate});
  }
  return region;
}

}  // namespace

bool operator==(const ArgumentEstimates& a, const ArgumentEstimates& b) {
  return same(a.scalar_def, b.scalar_def) && same(a.scalar_min, b.scalar_min) &&
         same(a.scalar_max, b.scalar_max) && same(a.scalar_estimate, b.scalar_estimate) &&
         same(a.buffer_estimates, b.buffer_estimates);
}

Argument::Argument(std::string name, Kind kind, const Type& type, int dimensions,
                   ArgumentEstimates estimates)
    : name(std::move(name)),
      kind(kind),
      dimensions(static_cast<uint8_t>(dimensions)),
      type(type),
      argument_estimates(std::move(estimates)) {
  if (dimensions < 0 || dimensions > 255 || (is_scalar() && dimensions != 0)) {
    user_error("make the Argument " + quoted(this->name),
               "a buffer has 0 to 255 dimensions, a scalar has none",
               text("it was given ", dimensions), "Give the dimensions that the argument has");
  }
}

bool operator==(const Argument& a, const Argument& b) {
  return a.name == b.name && a.kind == b.kind && a.dimensions == b.dimensions && a.type == b.type &&
         a.argument_estimates == b.argument_estimates;
}

namespace frontend {

Argument argument_of(const ParameterContents& parameter) {
  ArgumentEstimates estimates;
  if (parameter.is_buffer) {
    estimates.buffer_estimates = estimated_region(parameter);
    return {parameter.name, Argument::InputBuffer, parameter.type, parameter.dimensions, estimates};
  }
  if (parameter.value && !parameter.type.is_handle())
    estimates.scalar_def = to_expr(*parameter.value);
  estimates.scalar_min = parameter.min_value;
  estimates.scalar_max = parameter.max_value;
  estimates.scalar_estimate = parameter.estimate;
  return {parameter.name, Argument::InputScalar, parameter.type, 0, estimates};
}

}  // namespace frontend
}  // namespace retrograde
