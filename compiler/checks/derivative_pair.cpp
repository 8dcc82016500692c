#include "checks/derivative_pair.h"

#include <algorithm>
#include <utility>

#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/tangents.h"
#include "frontend/data/image_param.h"
#include "ir/build.h"

namespace retrograde::checks {

namespace {

// The weights as a Func with the types of `output`.
Func seed(const Func& output, const Shape& shape, const std::vector<Values>& weights) {
  std::vector<Expr> values;
  for (size_t k = 0; k < weights.size(); ++k) {
    if (weights[k].empty()) {
      values.push_back(0.0f);
      continue;
    }
    Buffer<> buffer = new_buffer(output.types()[k], shape);
    fill(buffer, weights[k]);
    std::vector<Expr> point;
    for (const Var& v : output.args()) point.push_back(v);
    values.push_back(buffer(point));
  }
  Func result("weights");
  result(output.args()) = Tuple(values);
  return result;
}

std::unique_ptr<Derivative> adjoints(const Func& output, const Shape& shape,
                                     const std::vector<Values>& weights) {
  return std::make_unique<Derivative>(propagate_adjoints(
      output, seed(output, shape, weights), region_of(shape), {.overwritten = Overwritten::Store}));
}

}  // namespace

DerivativePair::DerivativePair(const Func& output, const Shape& shape,
                               const std::vector<Values>& weights, std::string asked)
    : output_(output), asked_(std::move(asked)), own_(adjoints(output, shape, weights)) {
  std::vector<FuncPtr> all{output_.function()};
  if (has_rules()) add_adjoints(all);
  widened_ = widen(all);
  wide_output_ = Func(widened_.funcs.at(output_.function().get()));
  if (!has_rules()) wide_ = adjoints(wide_output_, shape, weights);
  // Parameters other than the inputs are weights, and parameters that custom rules read.
  const auto own_inputs = floating_inputs(output_);
  for (const auto& p : parameters_of(all)) {
    const auto wide = widened_.parameters.find(p.get());
    if (wide == widened_.parameters.end()) continue;
    const Input bound = bind_wide(p, wide->second, asked_);
    if (std::ranges::find(own_inputs, p) != own_inputs.end()) inputs_.push_back(bound);
  }
}

bool DerivativePair::has_rules() const {
  return std::ranges::any_of(topological_order({output_.function()}),
                             [](const FuncPtr& f) { return f->custom_derivatives != nullptr; });
}

void DerivativePair::add_adjoints(std::vector<FuncPtr>& to) const {
  for (const auto& p : floating_inputs(output_)) to.push_back(own_->of(AdjointInput(p)).function());
  for (const FuncPtr& f : topological_order({output_.function()})) {
    if (own_->has(Func(f))) to.push_back(own_->adjoint(Func(f)).function());
  }
}

// ---- adjoints ----

Func DerivativePair::own_adjoint(const Input& input) const {
  return own_->of(AdjointInput(input.own));
}

Func DerivativePair::wide_adjoint(const Input& input) const {
  return wide_adjoint(AdjointInput(input.own), AdjointInput(input.wide));
}

Func DerivativePair::own_adjoint(const FuncPtr& f) const { return own_->adjoint(Func(f)); }

Func DerivativePair::wide_adjoint(const FuncPtr& f) const {
  return wide_adjoint(Func(f), Func(widened_.funcs.at(f.get())));
}

// The adjoint of `input`, whose copy in double is `wide`.
Func DerivativePair::wide_adjoint(const AdjointInput& input, const AdjointInput& wide) const {
  if (wide_) return wide_->of(wide);
  return Func(widened_.funcs.at(own_->of(input).function().get()));
}

// ---- tangents ----

Func DerivativePair::tangent(const Input& input, const Buffer<>& direction) const {
  for (const FuncPtr& f : topological_order({output_.function()})) {
    if (autodiff::has_custom_tangent(*f)) return tangent_by_rules(input, direction);
  }
  return propagate_tangents(wide_output_, {{AdjointInput(input.wide), direction}})(wide_output_);
}

Func DerivativePair::tangent_by_rules(const Input& input, const Buffer<>& direction) const {
  Func own = propagate_tangents(output_, {{AdjointInput(input.own), direction}})(output_);
  Widened widened = widen({own.function()});
  for (const auto& p : parameters_of({own.function()})) {
    auto wide = widened.parameters.find(p.get());
    if (wide == widened.parameters.end()) continue;
    if (p == direction.parameter()) {
      ImageParam(wide->second).set(direction);
    } else {
      bind_wide(p, wide->second, asked_);
    }
  }
  return Func(widened.funcs.at(own.function().get()));
}

}  // namespace retrograde::checks
