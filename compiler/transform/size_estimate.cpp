#include "transform/size_estimate.h"

#include <HalideRuntime.h>

#include <algorithm>

#include "graph/definitions/own_reads.h"
#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

namespace {

Interval interval_of(const Expr& min, const Expr& extent) {
  return {min, min.defined() && extent.defined() ? min + extent - 1 : Expr()};
}

// Takes the ends that are known better or for the first time.
void refine(Interval& known, const Interval& by) {
  if (!known.min.defined()) known.min = by.min;
  if (!known.max.defined()) known.max = by.max;
}

void add_sizes(const ParameterContents& p, Scope<Interval>& scope) {
  for (int d = 0; d < p.dimensions; ++d) {
    const auto dimension = static_cast<size_t>(d);
    Expr min, extent;
    if (p.buffer) {
      min = make_const(Int(32), p.buffer->dim[d].min);
      extent = make_const(Int(32), p.buffer->dim[d].extent);
    } else if (dimension < p.constraints.size()) {
      const BufferConstraint& c = p.constraints[dimension];
      min = c.min.defined() ? c.min : c.min_estimate;
      extent = c.extent.defined() ? c.extent : c.extent_estimate;
    }
    const std::string number = std::to_string(d);
    if (min.defined()) scope.push(p.name + ".min." + number, Interval::point(min));
    if (extent.defined()) scope.push(p.name + ".extent." + number, Interval::point(extent));
  }
}

Scope<Interval> parameter_scope(const std::vector<FuncPtr>& outputs) {
  Scope<Interval> scope;
  for (const auto& p : parameters_of(outputs)) {
    if (p->is_buffer)
      add_sizes(*p, scope);
    else if (p->estimate.defined())
      scope.push(p->name, Interval::point(p->estimate));
  }
  return scope;
}

void refine_by(Interval& known, const Expr& min, const Expr& extent,
               const Scope<Interval>& parameters) {
  const Interval all = interval_of(min, extent);
  if (all.min.defined()) refine(known, {bounds_of(all.min, parameters).min, {}});
  if (all.max.defined()) refine(known, {{}, bounds_of(all.max, parameters).max});
}

// The size that its user or its maker states.
Interval told(const FuncContents& f, size_t d, const Scope<Interval>& parameters) {
  Interval result;
  for (const auto* entries : {&f.schedule.bounds, &f.schedule.estimates}) {
    for (const Bound& b : *entries) {
      if (b.var == f.args[d]) refine_by(result, b.min, b.extent, parameters);
    }
  }
  return constant_ends(result);
}

// The same of the buffer that an output of the pipeline fills.
Interval told_of_buffer(const FuncContents& f, size_t d, const Scope<Interval>& parameters) {
  Interval result;
  for (const auto& buffer : f.outputs) {
    if (d >= buffer->constraints.size()) continue;
    const BufferConstraint& c = buffer->constraints[d];
    refine_by(result, c.min, c.extent, parameters);
    refine_by(result, c.min_estimate, c.extent_estimate, parameters);
  }
  return constant_ends(result);
}

Scope<Interval> scope_of(const FuncContents& f, const Definition& stage, const Box& box,
                         const Scope<Interval>& parameters) {
  Scope<Interval> scope(&parameters);
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (is_pure_position(f, stage, d)) scope.push(f.args[d], box[d]);
  }
  for (const ReductionVariable& r : stage.rvars) {
    scope.push(r.var, constant_ends({bounds_of(r.min, parameters).min,
                                     bounds_of(r.min + r.extent - 1, parameters).max}));
  }
  return scope;
}

}  // namespace

SizeEstimate::SizeEstimate(const std::vector<FuncPtr>& outputs) {
  const Scope<Interval> parameters = parameter_scope(outputs);
  const std::vector<FuncPtr> order = topological_order(outputs);
  for (auto it = order.rbegin(); it != order.rend(); ++it) {
    const FuncContents& f = **it;
    Box& found = boxes_[&f];
    found.resize(f.args.size());
    const bool is_output = std::ranges::find(outputs, *it) != outputs.end();
    for (size_t d = 0; d < f.args.size(); ++d) {
      refine(found[d], told(f, d, parameters));
      if (is_output) refine(found[d], told_of_buffer(f, d, parameters));
    }
    const Box box = found;
    for (int s = 0; s < f.stage_count(); ++s) {
      const Scope<Interval> scope = scope_of(f, f.stage(s), box, parameters);
      for_each_expr(f.stage(s), [&](const Expr& e) {
        for (const auto& [name, read] : footprints(without_lets(e), scope)) {
          if (read.is_image || read.symbol.raw() == &f) continue;
          Box ends = read.box;
          for (Interval& i : ends) i = constant_ends(i);
          Box& callee = boxes_[read.symbol.raw()];
          callee = hull(callee, ends);
        }
      });
    }
  }
}

Interval constant_ends(const Interval& i) {
  const auto constant = [](const Expr& end) {
    const Expr simple = end.defined() ? simplify(end) : end;
    return simple.defined() && as_const_int(simple) ? simple : Expr();
  };
  return {constant(i.min), constant(i.max)};
}

std::optional<int64_t> SizeEstimate::extent(const FuncContents& f, size_t dimension) const {
  const auto found = boxes_.find(&f);
  if (found == boxes_.end() || !found->second[dimension].is_bounded()) return std::nullopt;
  const Interval& i = found->second[dimension];
  return *as_const_int(i.max) - *as_const_int(i.min) + 1;
}

Interval SizeEstimate::range(const FuncContents& f, size_t dimension) const {
  const auto found = boxes_.find(&f);
  return found == boxes_.end() ? Interval::everything() : found->second[dimension];
}

int64_t SizeEstimate::bytes(const FuncContents& f) const {
  int64_t result = 0;
  for (const Type& type : f.types) result += type.bytes();
  for (size_t d = 0; d < f.args.size(); ++d) result *= extent(f, d).value_or(0);
  return result;
}

}  // namespace retrograde::transform
