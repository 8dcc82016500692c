#include "autodiff/custom_derivative.h"

#include <algorithm>

#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "diagnostics/error.h"

namespace retrograde {

namespace {

using namespace autodiff;

bool is_given_twice(const std::vector<AdjointInput>& inputs, size_t i) {
  return std::any_of(inputs.begin(), inputs.begin() + static_cast<std::ptrdiff_t>(i),
                     [&](const AdjointInput& a) { return a.symbol() == inputs[i].symbol(); });
}

bool depends_on(const Func& func, const Symbol* symbol) {
  const auto is_it = [&](const auto& read) { return read.get() == symbol; };
  return std::ranges::any_of(topological_order({func.function()}), is_it) ||
         std::ranges::any_of(parameters_of({func.function()}), is_it);
}

void check_func(const std::string& asked, const Func& func, bool has_rule) {
  if (!func.defined()) {
    user_error(asked, "a rule belongs to a Func that is defined",
               quoted(func.name()) + " has no definition", "Define it first");
  }
  check_is_floating(asked, func.types(), "its type is", "Convert it to float");
  if (!has_rule) {
    user_error(asked, "a rule is a function", "there is none",
               "Give a function of the context that returns what the derivative is");
  }
}

void check_inputs(const std::string& asked, const Func& func,
                  const std::vector<AdjointInput>& inputs) {
  for (size_t i = 0; i < inputs.size(); ++i) {
    const Symbol* symbol = inputs[i].symbol().get();
    InputShape shape = shape_of(symbol);
    if (shape.types.empty()) {
      user_error(asked, "its inputs must be defined",
                 text("input ", i, " has no ", shape.name.empty() ? "memory" : "definition"),
                 "Define them first");
    }
    check_is_floating(asked, shape.types, text("the input ", quoted(shape.name), " has type"),
                      "Leave it out: nothing is propagated to integers");
    if (is_given_twice(inputs, i)) {
      user_error(asked, "each input is listed once", text(quoted(shape.name), " is listed twice"),
                 "Leave one out");
    }
    if (symbol == func.function().get() || !depends_on(func, symbol)) {
      user_error(asked, "its inputs are what the Func is computed from",
                 text(quoted(func.name()), symbol == func.function().get()
                                               ? " is listed itself"
                                               : " does not depend on " + quoted(shape.name)),
                 "List Funcs, images and Params that its definitions or extern arguments use, "
                 "directly or through other Funcs");
    }
  }
}

CustomDerivatives rules_of(const Func& func) {
  const auto now = custom_rules_of(*func.function());
  return now ? *now : CustomDerivatives();
}

void set_rules(const Func& func, CustomDerivatives rules) {
  func.function()->custom_derivatives = std::make_shared<const CustomDerivatives>(std::move(rules));
}

}  // namespace

bool AdjointContext::wants(const AdjointInput& input) const {
  return std::ranges::any_of(wanted_,
                             [&](const Wanted& w) { return w.input == input.symbol().get(); });
}

Region AdjointContext::region_of(const AdjointInput& input) const {
  for (const Wanted& w : wanted_) {
    if (w.input == input.symbol().get()) return w.region;
  }
  return {};
}

AdjointContribution AdjointContribution::zero(AdjointInput input) {
  AdjointContribution result(std::move(input), Func(std::make_shared<FuncContents>()));
  result.is_zero = true;
  return result;
}

bool TangentContext::moves(const AdjointInput& input) const {
  const Symbol* symbol = input.symbol().get();
  if (std::ranges::none_of(inputs_,
                           [&](const AdjointInput& i) { return i.symbol().get() == symbol; })) {
    InputShape shape = shape_of(symbol);
    user_error("propagate tangents through " + quoted(func_.name()),
               "a rule asks for the tangents of its inputs",
               text(quoted(shape.name), " is not listed"), "List it in custom_tangent");
  }
  return std::ranges::any_of(moving_, [&](const auto& m) { return m.first == symbol; });
}

Func TangentContext::tangent(const AdjointInput& input) const {
  const Symbol* symbol = input.symbol().get();
  if (!moves(input)) return Func(zero_derivative(*symbol, "_tan"));
  return std::ranges::find_if(moving_, [&](const auto& m) { return m.first == symbol; })->second;
}

void custom_adjoint(const Func& func, const std::vector<AdjointInput>& inputs, CustomAdjoint rule,
                    ExternReads reads) {
  std::string asked = "give " + quoted(func.name()) + " a custom adjoint";
  check_func(asked, func, rule != nullptr);
  check_inputs(asked, func, inputs);
  if (reads && !func.is_extern()) {
    user_error(asked, "what a Func reads is told for extern stages only",
               quoted(func.name()) + " has definitions, which show what it reads",
               "Leave the last argument out");
  }
  CustomDerivatives rules = rules_of(func);
  rules.adjoint_inputs = inputs;
  rules.adjoint = std::move(rule);
  rules.reads = std::move(reads);
  set_rules(func, std::move(rules));
}

void custom_tangent(const Func& func, const std::vector<AdjointInput>& inputs, CustomTangent rule) {
  std::string asked = "give " + quoted(func.name()) + " a custom tangent";
  check_func(asked, func, rule != nullptr);
  check_inputs(asked, func, inputs);
  CustomDerivatives rules = rules_of(func);
  rules.tangent_inputs = inputs;
  rules.tangent = std::move(rule);
  set_rules(func, std::move(rules));
}

}  // namespace retrograde
