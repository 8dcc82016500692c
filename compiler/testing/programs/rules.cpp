// Custom derivatives, all of them correct: the gradient is that without them.
#include "autodiff/custom_derivative.h"
#include "autodiff/straight_through.h"
#include "autodiff/tangents.h"
#include "ir/visit.h"
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

namespace {

bool is_floating(const Func& f) {
  return std::ranges::all_of(f.types(), [](const Type& t) { return t.is_float(); });
}

// The synthesized derivative of `source` by its inputs, as the rule of a copy of it returns it.
std::vector<AdjointContribution> by_synthesis(const Func& source,
                                              const std::vector<AdjointInput>& inputs,
                                              const AdjointContext& c) {
  AdjointOptions options{.overwritten = Overwritten::Store};
  for (const AdjointInput& input : inputs) {
    if (c.wants(input)) options.wrt.push_back(input);
  }
  std::vector<AdjointContribution> result;
  if (options.wrt.empty()) return result;
  const Derivative d = propagate_adjoints(source, c.adjoint(), c.region(), options);
  for (const AdjointInput& input : options.wrt) result.emplace_back(input, d.of(input));
  return result;
}

Func tangent_by_synthesis(const Func& source, const std::vector<AdjointInput>& inputs,
                          const TangentContext& c) {
  std::vector<Direction> directions;
  for (const AdjointInput& input : inputs) {
    if (c.moves(input)) directions.emplace_back(input, c.tangent(input));
  }
  return propagate_tangents(source, directions)(source);
}

// Elements outside of the region read may be NaN, which must not be multiplied by a derivative of 0.
Expr times(const Expr& derivative, const Expr& partial) {
  const Expr zero = cast(partial.type(), Expr(0.0f));
  return derivative * cast(derivative.type(), select(is_finite(partial), partial, zero));
}

// f(x) = sin(source(x)).
void give_closed_rule(const Func& f, const Func& source) {
  const CustomAdjoint rule = [source](const AdjointContext& c) {
    Func contribution("rule_adj");
    const std::vector<Var> vars = c.adjoint().args();
    std::vector<Expr> values;
    for (int k = 0; k < source.outputs(); ++k) {
      const Expr adjoint = c.adjoint()(vars).element(k);
      values.push_back(times(adjoint, cos(source(vars).element(k))));
    }
    contribution(vars) = Tuple(values);
    return std::vector<AdjointContribution>{{source, contribution}};
  };
  ExternReads reads;
  if (f.is_extern()) reads = [](const AdjointInput&, const Region& of_func) { return of_func; };
  custom_adjoint(f, {source}, rule, reads);
  custom_tangent(f, {source}, [source](const TangentContext& c) {
    Func result("rule_tan");
    const Func tangent = c.tangent(source);
    const std::vector<Var> vars = first_variables(source.dimensions());
    std::vector<Expr> values;
    for (int k = 0; k < source.outputs(); ++k) {
      const Expr t = tangent(vars).element(k);
      values.push_back(times(t, cos(source(vars).element(k))));
    }
    result(vars) = Tuple(values);
    return result;
  });
}

}  // namespace

// Values equal to `a`, written so that custom derivatives act in them.
Expr Maker::ruled(const Type& type, const Point& at, int depth) {
  const Expr a = value(type, at, depth - 1);
  const auto one_factor_at_a_time = [&] {
    const Expr b = leaf(type, at);
    p_.stops_gradients = true;
    return stop_gradient(a) * b + a * stop_gradient(b) - stop_gradient(a * b);
  };
  return c_.one_of<Expr>({
      [&] { return straight_through(a, a * converted(type, Expr(2.0f)) - a); },
      one_factor_at_a_time,
      [&] { return a + stop_gradient(floor(a)); },
      [&] { return straight_through(a + converted(type, floor(leaf(type, at))), a); },
      [&] { return select(stop_gradient(a) > converted(type, Expr(0.5f)), a, leaf(type, at)); },
  });
}

// A Func that reads the last one, with custom derivatives: by all inputs of the program, or by the Func read.
void Maker::add_custom() {
  const Func source = p_.funcs.back();
  if (!is_floating(source)) return;
  Func f("ruled" + std::to_string(p_.funcs.size()));
  const std::vector<Var> vars = first_variables(source.dimensions());
  finish(f);
  const bool is_sine = c_.chance(50);
  p_.has_stage = is_sine && source.outputs() == 1 && source.type() == Float(32);
  if (p_.has_stage && s_.extern_sine) {
    s_.extern_sine(f, source);
    return give_closed_rule(f, source);
  }
  std::vector<Expr> values;
  for (int k = 0; k < source.outputs(); ++k) {
    const Expr value = source(vars).element(k);
    values.push_back(is_sine ? sin(value) : value);
  }
  f(vars) = Tuple(values);
  if (is_sine) return give_closed_rule(f, source);
  std::vector<AdjointInput> inputs;
  const auto parameters = graph::parameters_of({source.function()});
  auto add = [&](const AdjointInput& input) {
    const bool is_read = std::ranges::any_of(
        parameters, [&](const auto& p) { return p.get() == input.symbol().get(); });
    if (is_read) inputs.push_back(input);
  };
  for (size_t i = 0; i < p_.images.size(); ++i) add(p_.image(i));
  add(p_.scale);
  if (inputs.empty()) return;
  p_.has_rule = true;
  custom_adjoint(f, inputs, [source, inputs](const AdjointContext& c) {
    return by_synthesis(source, inputs, c);
  });
  custom_tangent(f, inputs, [source, inputs](const TangentContext& c) {
    return tangent_by_synthesis(source, inputs, c);
  });
}

}  // namespace retrograde::fuzz
