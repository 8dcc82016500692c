// Consumers first: the extents of a Func give the regions that it reads of others.
#include "autoschedule/access/sizes.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <cmath>

#include "analysis/interval.h"
#include "ir/build.h"
#include "ir/scalar.h"
#include "simplify/simplify.h"

namespace retrograde::planning {

namespace {

using ir::ConstantRange;

// Larger numbers are extremes of their types, not sizes.
constexpr int64_t unbounded = 1'000'000'000'000;

int64_t saturated(__int128 value) {
  if (value >= unbounded) return INT64_MAX;
  return value <= -unbounded ? INT64_MIN : static_cast<int64_t>(value);
}

ConstantRange sum(const ConstantRange& a, const ConstantRange& b) {
  ConstantRange result;
  if (a.has_lower_bound() && b.has_lower_bound()) result.min = saturated(__int128{a.min} + b.min);
  if (a.has_upper_bound() && b.has_upper_bound()) result.max = saturated(__int128{a.max} + b.max);
  return result;
}

ConstantRange product(const ConstantRange& a, int64_t factor) {
  ConstantRange result;
  const ConstantRange turned = factor < 0 ? ConstantRange{a.max, a.min} : a;
  const auto is_bound = [](int64_t end) { return end != INT64_MIN && end != INT64_MAX; };
  if (is_bound(turned.min)) result.min = saturated(__int128{turned.min} * factor);
  if (is_bound(turned.max)) result.max = saturated(__int128{turned.max} * factor);
  return result;
}

ConstantRange quotient(ConstantRange a, int64_t divisor) {
  if (a.has_lower_bound()) a.min = ir::euclidean_div(a.min, divisor);
  if (a.has_upper_bound()) a.max = ir::euclidean_div(a.max, divisor);
  return a;
}

ConstantRange remainder(const ConstantRange& a, int64_t modulus) {
  const bool stays =
      a.is_bounded() && ir::euclidean_div(a.min, modulus) == ir::euclidean_div(a.max, modulus);
  if (!stays) return {0, modulus - 1};
  return {ir::euclidean_mod(a.min, modulus), ir::euclidean_mod(a.max, modulus)};
}

int64_t count(const ConstantRange& range) { return std::max<int64_t>(range.extent(), 0); }

}  // namespace

SizeModel::SizeModel(const AccessGraph& graph, const SizeDefaults& defaults)
    : graph_(graph), defaults_(defaults) {
  add_parameters();
  images_.resize(graph.images().size());
  for (size_t i = 0; i < images_.size(); ++i) find_image(static_cast<ImageId>(i));
  find_all();
  if (add_adjoints()) find_all();
}

void SizeModel::find_all() {
  const size_t count = graph_.funcs().size();
  funcs_.assign(count, {});
  iterators_.assign(count, {});
  regions_.clear();
  bounds_.clear();
  for (const FuncNode& node : graph_.funcs()) regions_.emplace_back(node.func->args.size());
  for (size_t id = count; id-- > 0;) {
    find_func(static_cast<FuncId>(id));
    iterators_[id].resize(graph_.funcs()[id].stages.size());
    for (const StageNode& stage : graph_.funcs()[id].stages) {
      find_iterators(stage.id);
      for (const Access& read : stage.reads) pass_on(read);
    }
  }
}

// Notes how large the Func is of which an output is the adjoint, where it is known. Returns whether there are such.
bool SizeModel::add_adjoints() {
  for (size_t id = 0; id < funcs_.size(); ++id) {
    const FuncContents& f = *graph_.funcs()[id].func;
    const auto is_primal = [&](const FuncNode& node) { return node.func->name == f.made->of; };
    const bool is_unknown = std::ranges::any_of(
        funcs_[id], [](const Known& known) { return known.source == SizeSource::Default; });
    if (!graph_.funcs()[id].is_output || !is_unknown || !f.made ||
        f.made->role != graph::Role::Adjoint)
      continue;
    const auto primal = std::ranges::find_if(graph_.funcs(), is_primal);
    if (primal == graph_.funcs().end() || primal->func->args.size() != f.args.size()) continue;
    std::vector<Known> known = funcs_[static_cast<size_t>(primal - graph_.funcs().begin())];
    for (Known& dimension : known) {
      dimension.source = std::max(dimension.source, SizeSource::Region);
      dimension.is_certain = false;
    }
    adjoints_.emplace(static_cast<FuncId>(id), std::move(known));
  }
  return !adjoints_.empty();
}

// ---- what is known from outside ----

void SizeModel::add_parameters() {
  std::vector<FuncPtr> outputs;
  for (const FuncNode& node : graph_.funcs())
    if (node.is_output) outputs.push_back(node.func);
  for (const auto& p : parameters_of(outputs)) {
    if (!p->is_buffer) {
      if (p->estimate.defined()) parameters_.push(p->name, Interval::point(p->estimate));
      continue;
    }
    for (int d = 0; d < p->dimensions; ++d) {
      Expr min, extent;
      if (p->buffer) {
        min = make_const(Int(32), p->buffer->dim[d].min);
        extent = make_const(Int(32), p->buffer->dim[d].extent);
      } else if (static_cast<size_t>(d) < p->constraints.size()) {
        const BufferConstraint& c = p->constraints[static_cast<size_t>(d)];
        min = c.min.defined() ? c.min : c.min_estimate;
        extent = c.extent.defined() ? c.extent : c.extent_estimate;
      }
      const std::string number = std::to_string(d);
      if (min.defined()) parameters_.push(p->name + ".min." + number, Interval::point(min));
      if (extent.defined())
        parameters_.push(p->name + ".extent." + number, Interval::point(extent));
    }
  }
}

std::optional<int64_t> SizeModel::certain_value(const Expr& e) const {
  return e.defined() ? as_const_int(simplify(e)) : std::nullopt;
}

std::optional<int64_t> SizeModel::end_of(const Expr& e, bool is_min) const {
  if (!e.defined()) return std::nullopt;
  if (const auto constant = as_const_int(e)) return constant;
  auto& known = ends_[is_min ? 0 : 1];
  if (const auto* end = ir::find_or_null(known, e.get())) return end->second;
  const Interval all = analysis::bounds_of(e, parameters_);
  const Expr end = is_min ? all.min : all.max;
  const auto value = end.defined() ? as_const_int(simplify(end)) : std::nullopt;
  known.emplace(e.get(), std::pair(e, value));
  return value;
}

ConstantRange SizeModel::range(const Interval& i) const {
  ConstantRange result;
  if (const auto min = end_of(i.min, true)) result.min = saturated(*min);
  if (const auto max = end_of(i.max, false)) result.max = saturated(*max);
  return result;
}

void SizeModel::find_image(ImageId image) {
  const ParameterContents& p = *graph_.images()[static_cast<size_t>(image)];
  for (int d = 0; d < p.dimensions; ++d) {
    const auto dimension = static_cast<size_t>(d);
    Ends ends;
    if (dimension < p.constraints.size()) {
      const BufferConstraint& c = p.constraints[dimension];
      refine(ends, c.min, c.extent, SizeSource::Bound);
      refine(ends, c.min_estimate, c.extent_estimate, SizeSource::Estimate);
    }
    if (p.buffer) {
      const halide_dimension_t& shape = p.buffer->dim[d];
      const End min{shape.min, SizeSource::Image, p.is_literal};
      const End max{int64_t{shape.min} + shape.extent - 1, SizeSource::Image, p.is_literal};
      if (!ends.min.value) ends.min = min;
      if (!ends.max.value) ends.max = max;
    }
    images_[static_cast<size_t>(image)].push_back(settled(ends, nullptr));
  }
}

// Fills the ends that are unknown.
void SizeModel::refine(Ends& ends, const Expr& min, const Expr& extent, SizeSource source) const {
  const Expr max = min.defined() && extent.defined() ? min + extent - 1 : Expr();
  const auto fill = [&](End& end, const Expr& e, bool is_min) {
    const auto value = end.value ? std::nullopt : end_of(e, is_min);
    const bool is_certain = source == SizeSource::Bound && certain_value(e).has_value();
    if (value) end = {value, source, is_certain};
  };
  fill(ends.min, min, true);
  fill(ends.max, max, false);
}

SizeModel::Ends SizeModel::told(const FuncNode& node, size_t dimension) const {
  const FuncContents& f = *node.func;
  Ends ends;
  for (const Bound& b : f.schedule.bounds)
    if (b.var == f.args[dimension]) refine(ends, b.min, b.extent, SizeSource::Bound);
  for (const Bound& b : f.schedule.estimates)
    if (b.var == f.args[dimension]) refine(ends, b.min, b.extent, SizeSource::Estimate);
  if (!node.is_output) return ends;
  for (const auto& buffer : f.outputs) {
    if (dimension >= buffer->constraints.size()) continue;
    const BufferConstraint& c = buffer->constraints[dimension];
    refine(ends, c.min, c.extent, SizeSource::Bound);
    refine(ends, c.min_estimate, c.extent_estimate, SizeSource::Estimate);
  }
  return ends;
}

// An estimate of a Func that others read is no limit to what they need.
void SizeModel::extend(Ends& ends, const ConstantRange& needed) {
  if (needed.min > needed.max) return;
  if (ends.min.source == SizeSource::Estimate && ends.min.value)
    ends.min.value = std::min(*ends.min.value, needed.min);
  if (ends.max.source == SizeSource::Estimate && ends.max.value)
    ends.max.value = std::max(*ends.max.value, needed.max);
}

// An end that nothing gives leaves the other one where it is and takes the default extent.
SizeModel::Known SizeModel::settled(const Ends& ends, const Known* region) const {
  Ends all = ends;
  const auto fill = [&](End& end, int64_t value, bool is_bound) {
    if (!end.value && is_bound) end = {value, region->source, region->is_certain};
  };
  if (region) {
    fill(all.min, region->range.min, region->range.has_lower_bound());
    fill(all.max, region->range.max, region->range.has_upper_bound());
  }
  Known known;
  known.source = std::max(all.min.source, all.max.source);
  known.is_certain = all.min.is_certain && all.max.is_certain;
  if (!all.min.value) all.min.value = all.max.value ? *all.max.value - defaults_.extent + 1 : 0;
  if (!all.max.value) all.max.value = *all.min.value + defaults_.extent - 1;
  known.range = {*all.min.value, *all.max.value};
  if (known.is_certain && known.source == SizeSource::Bound)
    known.multiple_of = std::max<int64_t>(count(known.range), 1);
  return known;
}

// ---- Funcs, their loops, and what these read ----

void SizeModel::find_func(FuncId id) {
  const FuncNode& node = graph_.func(id);
  for (size_t d = 0; d < node.func->args.size(); ++d) {
    const auto& region = regions_[static_cast<size_t>(id)][d];
    Ends ends = told(node, d);
    if (region && !node.is_output) extend(ends, region->needed);
    const auto* adjoint = ir::find_or_null(adjoints_, id);
    const Known* other = adjoint ? &(*adjoint)[d] : nullptr;
    if (region) other = &*region;
    Known known = settled(ends, other);
    for (const Bound& b : node.func->schedule.bounds) {
      const auto modulus = b.var == node.func->args[d] ? certain_value(b.modulus) : std::nullopt;
      if (modulus && known.multiple_of == 1) known.multiple_of = std::max<int64_t>(*modulus, 1);
    }
    funcs_[static_cast<size_t>(id)].push_back(known);
  }
}

void SizeModel::find_iterators(StageId stage) {
  auto& known = iterators_[static_cast<size_t>(stage.func)][static_cast<size_t>(stage.stage)];
  for (const Iterator& i : graph_.stage(stage).iterators) {
    if (i.kind == Iterator::Kind::Pure) {
      known.push_back(funcs_[static_cast<size_t>(stage.func)][static_cast<size_t>(i.dimension)]);
      continue;
    }
    Ends ends;
    refine(ends, i.min, i.extent, SizeSource::Bound);
    for (End* end : {&ends.min, &ends.max})  // of parameters
      if (end->value && !end->is_certain) end->source = SizeSource::Estimate;
    known.push_back(settled(ends, nullptr));
  }
}

// Whether the loops read all elements that the index has.
bool SizeModel::is_needed(const Access& read, size_t dimension) const {
  const IndexForm& form = read.index[dimension];
  if (!form.is_affine() || form.clamped) return false;
  const auto moves_it = [&](const IndexForm& condition) {
    return (condition.moved_by() & form.moved_by()) != 0;
  };
  return std::ranges::none_of(graph_.stage(read.by).guard.nonnegative, moves_it) &&
         std::ranges::none_of(read.guard.nonnegative, moves_it);
}

void SizeModel::pass_on(const Access& read) {
  if (read.of < 0 || read.of == read.by.func) return;
  const auto& loops =
      iterators_[static_cast<size_t>(read.by.func)][static_cast<size_t>(read.by.stage)];
  for (size_t d = 0; d < read.index.size(); ++d) {
    Known found{range(read.index[d], read.by), SizeSource::Region, true, 1};
    // A clamp bounds the region even if nothing is known of the loops.
    const bool is_bounded = range(read.index[d].within).is_bounded();
    for (size_t i = 0; i < loops.size(); ++i) {
      if ((read.index[d].moved_by() & set_of(static_cast<int>(i))) == 0) continue;
      found.is_certain = found.is_certain && loops[i].is_certain;
      if (loops[i].source == SizeSource::Default && !is_bounded) found.source = SizeSource::Default;
    }
    if (!read.index[d].is_affine() || read.index[d].clamped) found.is_certain = false;
    if (!found.range.is_bounded()) found.source = SizeSource::Default;
    if (found.source != SizeSource::Default && is_needed(read, d)) found.needed = found.range;
    std::optional<Known>& known = regions_[static_cast<size_t>(read.of)][d];
    if (known) {
      found.range = hull(known->range, found.range);
      found.needed = hull(known->needed, found.needed);
      found.is_certain = found.is_certain && known->is_certain;
      found.source = std::max(found.source, known->source);
    }
    known = found;
  }
}

// ---- indices ----

// Where the form loses what terms have in common, as in x - x / 2 * 2.
ConstantRange SizeModel::bounds_in(const Expr& index, StageId stage) const {
  const auto [known, is_new] = bounds_.try_emplace({stage, index.get()}, index, ConstantRange());
  if (!is_new) return known->second.second;
  analysis::Scope<Interval> scope(&parameters_);
  const auto& iterators = graph_.stage(stage).iterators;
  for (size_t i = 0; i < iterators.size(); ++i) {
    const ConstantRange loop = range(stage, static_cast<int>(i));
    const bool fits = loop.min >= INT32_MIN && loop.max <= INT32_MAX;
    scope.push(
        iterators[i].name,
        fits ? Interval{make_const(Int(32), loop.min), make_const(Int(32), loop.max)} : Interval());
  }
  return known->second.second = range(analysis::bounds_of(index, scope));
}

ConstantRange SizeModel::range(const IndexForm& form, StageId stage) const {
  ConstantRange result{form.low, form.high};
  for (const Term& term : form.terms)
    result = sum(result, product(range(stage, term.iterator), term.coefficient));
  for (const OpaqueTerm& term : form.opaque)
    result = sum(result, product(range(term.range), term.coefficient));
  if (form.divisor != 1) result = quotient(result, form.divisor);
  if (form.modulus != 0) result = remainder(result, form.modulus);
  if (form.expr.defined()) result = intersection(result, bounds_in(form.expr, stage));
  const ConstantRange all = range(form.within);
  if (form.turned && !result.is_within(all)) return all;
  const ConstantRange inside = intersection(result, all);
  // A range beyond the border is read at the border.
  if (inside.min <= inside.max) return inside;
  const int64_t border = result.min > all.max ? all.max : all.min;
  return ConstantRange::point(border);
}

// ---- answers ----

Extent SizeModel::extent_of(const Known& known) const {
  Extent result;
  result.estimate = count(known.range);
  result.source = known.source;
  result.multiple_of = known.multiple_of;
  const bool is_upper = known.source == SizeSource::Region || known.source == SizeSource::Default;
  result.low = known.is_certain && !is_upper ? result.estimate : 0;
  result.high = known.is_certain ? result.estimate : INT64_MAX;
  return result;
}

Extent SizeModel::of(FuncId func, size_t dimension) const {
  return extent_of(funcs_[static_cast<size_t>(func)][dimension]);
}
Extent SizeModel::of_image(ImageId image, size_t dimension) const {
  return extent_of(images_[static_cast<size_t>(image)][dimension]);
}
Extent SizeModel::of(StageId stage, int iterator) const {
  return extent_of(iterators_[static_cast<size_t>(stage.func)][static_cast<size_t>(stage.stage)]
                             [static_cast<size_t>(iterator)]);
}
ConstantRange SizeModel::range(FuncId func, size_t dimension) const {
  return funcs_[static_cast<size_t>(func)][dimension].range;
}
ConstantRange SizeModel::range(StageId stage, int iterator) const {
  return iterators_[static_cast<size_t>(stage.func)][static_cast<size_t>(stage.stage)]
                   [static_cast<size_t>(iterator)]
                       .range;
}

}  // namespace retrograde::planning
