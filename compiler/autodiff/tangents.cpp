#include "autodiff/tangents.h"

#include <algorithm>

#include "autodiff/sweeps/input_shape.h"
#include "autodiff/sweeps/tangent_synthesis.h"
#include "ir/build.h"

namespace retrograde {

namespace {

using namespace autodiff;

std::string asked_of_tangents(const Func& output) {
  return "propagate tangents to " + quoted(output.name());
}

InputShape shape_of(const Func& output, const Symbol* symbol) {
  InputShape shape = autodiff::shape_of(symbol);
  if (shape.types.empty()) {
    user_error(asked_of_tangents(output), "what moves must be defined",
               shape.name.empty() ? "an input has no memory and no type"
                                  : quoted(shape.name) + " has no definition",
               "Define it first");
  }
  return shape;
}

void check_direction(const Func& output, const InputShape& shape, const Func& tangent) {
  if (tangent.defined()) {
    check_is_floating(asked_of_tangents(output), shape.types, quoted(shape.name) + " has type",
                      "Convert it to float in a Func, and give that a direction");
  }
  check_shape(asked_of_tangents(output), "a direction", "what moves", shape, *tangent.function());
}

}  // namespace

Direction::Direction(AdjointInput input, const Func& tangent)
    : input(std::move(input)), tangent(tangent) {}

Func Direction::as_func(const Buffer<>& buffer) {
  if (!buffer.defined()) return Func();
  Func f("direction");
  std::vector<Var> vars;
  std::vector<Expr> args;
  for (int d = 0; d < buffer.dimensions(); ++d) {
    vars.emplace_back("_" + std::to_string(d));
    args.emplace_back(vars.back());
  }
  auto parameter = buffer.parameter();
  f(vars) = call_image(parameter->name, parameter->type, args, SymbolRef(parameter));
  return f;
}

Tangents::Tangents(std::shared_ptr<const TangentResult> result) : result_(std::move(result)) {}

Func Tangents::operator()(const Func& func) const {
  const auto& order = result_->order;
  if (std::ranges::find(order, func.function()) == order.end())
    return Func(std::make_shared<FuncContents>());
  const auto* found = ir::find_or_null(result_->tangents, func.function().get());
  return Func(found ? *found : zero_tangent(*func.function()));
}

std::vector<Func> Tangents::funcs() const { return {result_->funcs.begin(), result_->funcs.end()}; }

const std::vector<Explanation>& Tangents::explanations() const { return result_->explanations; }

Tangents propagate_tangents(const Func& output, const std::vector<Direction>& directions) {
  check_output(asked_of_tangents(output), *output.function(), "Convert it to float");
  if (directions.empty()) {
    user_error(asked_of_tangents(output), "something has to move", "there is no direction",
               "Give each input that moves with its direction");
  }
  Directions by_symbol;
  for (const Direction& d : directions) {
    const Symbol* symbol = d.input.symbol().get();
    InputShape shape = shape_of(output, symbol);
    check_direction(output, shape, d.tangent);
    if (!by_symbol.emplace(symbol, d.tangent.function()).second) {
      user_error(asked_of_tangents(output), "each input has one direction",
                 text("there are two for ", quoted(shape.name)), "Add them in one Func");
    }
  }
  return Tangents(
      std::make_shared<TangentResult>(synthesize_tangents(output.function(), by_symbol)));
}

}  // namespace retrograde
