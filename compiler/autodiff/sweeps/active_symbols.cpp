#include "autodiff/sweeps/active_symbols.h"

#include <algorithm>

#include "autodiff/rules/invariance.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

const ParameterContents* as_parameter(const Symbol* symbol) {
  return dynamic_cast<const ParameterContents*>(symbol);
}

Symbol* symbol_of(const Expr& leaf) {
  if (const auto* call = leaf.as<Call>()) return call->symbol.raw();
  const auto* v = leaf.as<Variable>();
  return v && as_parameter(v->symbol.raw()) && !as_parameter(v->symbol.raw())->is_buffer
             ? v->symbol.raw()
             : nullptr;
}

ActiveSymbols::ActiveSymbols(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& order,
                             const SynthesisOptions& options)
    : options_(options), cancelling_(cancelling_funcs(order, outputs)) {
  for (const auto& parameter : parameters_of(outputs)) {
    if (parameter->type.is_float() && is_requested(parameter.get()))
      active_.insert(parameter.get());
  }
  for (const FuncPtr& f : order) {
    if (!is_floating(f->types) || cancels(f.get())) continue;
    bool passes = passes_on(*f);
    if (passes) passing_.insert(f.get());
    if (passes || is_requested(f.get())) active_.insert(f.get());
  }
}

bool ActiveSymbols::is_requested(const Symbol* symbol) const {
  if (options_.left_out.contains(symbol)) return false;
  return !options_.only_requested || options_.requested.contains(symbol);
}

bool ActiveSymbols::contains(const Expr& leaf) const {
  Symbol* symbol = symbol_of(leaf);
  return symbol && contains(symbol);
}

bool ActiveSymbols::passes_on(const FuncContents& f) const {
  const auto is_active = [&](const auto& symbol) { return contains(symbol.get()); };
  if (has_custom_adjoint(f)) {
    const auto rules = custom_rules_of(f);
    for (const AdjointInput& input : rules->adjoint_inputs) {
      if (is_active(input.symbol())) return true;
    }
  }
  if (f.custom_derivatives || f.is_extern()) {
    const auto read = read_by(f);
    if (std::ranges::any_of(read, is_active)) return true;
  }
  bool found = false;
  for (int s = 0; s < f.stage_count() && !found; ++s) found = reads_active(f.stage(s));
  return found;
}

bool ActiveSymbols::reads_active(const Definition& definition) const {
  return any_node(definition,
                  [&](const Expr& e) { return (e.as<Call>() || e.as<Variable>()) && contains(e); });
}

}  // namespace retrograde::autodiff
