#include "autodiff/tangents.h"

#include <algorithm>

#include "autodiff/accumulation.h"
#include "autodiff/tangent_synthesis.h"
#include "ir/build.h"

namespace retrograde {

namespace {

std::string asked(const Func& output) { return "propagate tangents to " + quoted(output.name()); }

bool is_floating(const std::vector<Type>& types) {
  return std::any_of(types.begin(), types.end(), [](Type t) { return t.is_float(); });
}

void check_output(const Func& output) {
  if (!output.defined()) {
    user_error(asked(output), "the output must be defined", "it has no definition",
               "Define it first");
  }
  if (!is_floating(output.types())) {
    user_error(asked(output), "only floating-point values have derivatives",
               "its type is " + to_string(output.types()[0]), "Convert it to float");
  }
}

// What a direction must look like.
struct Shape {
  std::string name;
  int dimensions;
  std::vector<Type> types;
};
Shape shape_of(const Func& output, const ir::Symbol* symbol) {
  if (const auto* p = dynamic_cast<const ir::ParameterContents*>(symbol))
    return {p->name, p->is_buffer ? p->dimensions : 0, {p->type}};
  const auto* f = dynamic_cast<const ir::FuncContents*>(symbol);
  if (!f || !f->is_defined()) {
    user_error(asked(output), "what moves must be defined",
               f ? quoted(f->name) + " has no definition" : "an input has no memory and no type");
  }
  return {f->name, f->dimensions(), f->types};
}

void check_direction(const Func& output, const Shape& shape, const Func& tangent) {
  if (!tangent.defined()) {
    user_error(asked(output), "a direction must be defined",
               text("that of ", quoted(shape.name), " has no definition"));
  }
  if (!is_floating(shape.types)) {
    user_error(asked(output), "only floating-point values have derivatives",
               text(quoted(shape.name), " has type ", to_string(shape.types[0])),
               "Convert it to float in a Func, and give that a direction");
  }
  if (tangent.dimensions() != shape.dimensions) {
    user_error(asked(output), "a direction has the dimensions of what moves",
               text(quoted(tangent.name()), " has ", tangent.dimensions(), " and ",
                    quoted(shape.name), " has ", shape.dimensions),
               "Define the direction over the same dimensions");
  }
  if (tangent.types().size() != shape.types.size()) {
    user_error(asked(output), "a direction has as many values as what moves",
               text(quoted(tangent.name()), " has ", tangent.types().size(), " and ",
                    quoted(shape.name), " has ", shape.types.size()));
  }
  for (Type t : tangent.types()) {
    if (t.is_float()) continue;
    user_error(asked(output), "a direction is made of floating-point values",
               text(quoted(tangent.name()), " has type ", to_string(t)));
  }
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
  f(vars) = ir::call_image(parameter->name, parameter->type, args, ir::SymbolRef(parameter));
  return f;
}

Tangents::Tangents(std::shared_ptr<const ir::TangentResult> result) : result_(std::move(result)) {}

Func Tangents::operator()(const Func& func) const {
  const auto& order = result_->order;
  if (std::find(order.begin(), order.end(), func.function()) == order.end())
    return Func(std::make_shared<ir::FuncContents>());
  auto found = result_->tangents.find(func.function().get());
  return found == result_->tangents.end() ? Func(ir::zero_tangent(*func.function()))
                                          : Func(found->second);
}

std::vector<Func> Tangents::funcs() const { return {result_->funcs.begin(), result_->funcs.end()}; }

const std::vector<Explanation>& Tangents::explanations() const { return result_->explanations; }

Tangents propagate_tangents(const Func& output, const std::vector<Direction>& directions) {
  check_output(output);
  if (directions.empty()) {
    user_error(asked(output), "something has to move", "there is no direction",
               "Give each input that moves with its direction");
  }
  ir::Directions by_symbol;
  for (const Direction& d : directions) {
    const ir::Symbol* symbol = d.input.symbol().get();
    Shape shape = shape_of(output, symbol);
    check_direction(output, shape, d.tangent);
    if (!by_symbol.emplace(symbol, d.tangent.function()).second) {
      user_error(asked(output), "each input has one direction",
                 text("there are two for ", quoted(shape.name)), "Add them in one Func");
    }
  }
  return Tangents(
      std::make_shared<ir::TangentResult>(ir::synthesize_tangents(output.function(), by_symbol)));
}

}  // namespace retrograde
