// generator_input.cpp -- the values of inputs: parameters of a compiled function, or values from C++.
#include "generator/generator_input.h"

#include "generator/generator_base.h"

namespace retrograde::internal {

InputValue InputValue::of_func(const Func& f) {
  InputValue value;
  value.kind = IOKind::Function;
  value.func = f;
  return value;
}

InputValue InputValue::of_expr(const Expr& e) {
  InputValue value;
  value.expr = e;
  return value;
}

InputValue InputValue::of_image(std::shared_ptr<graph::ParameterContents> image) {
  InputValue value;
  value.kind = IOKind::Buffer;
  value.parameter = std::move(image);
  return value;
}

std::vector<Type> InputValue::types() const {
  if (parameter) return {parameter->type};
  return kind == IOKind::Function ? func.types() : std::vector{expr.type()};
}

int InputValue::dims() const {
  if (parameter) return parameter->dimensions;
  return kind == IOKind::Function ? func.dimensions() : 0;
}

GeneratorInputBase::GeneratorInputBase(Declared declared, IOKind kind, Declared fixed,
                                       bool is_array)
    : GeneratorPort(std::move(declared), kind, std::move(fixed), is_array, false) {
  if (GeneratorMembers* members = GeneratorMembers::around(this)) members->inputs.push_back(this);
}

void GeneratorInputBase::make_parameters() {
  std::vector<InputValue> values;
  for (size_t i = 0; i < array_size(); i++) {
    if (kind() == IOKind::Scalar) {
      const auto parameter = frontend::make_scalar_parameter(type(), element_name(i));
      describe(*parameter);
      values.push_back(value_of(parameter));
    } else {
      values.push_back(value_of(ImageParam(type(), dims(), element_name(i)).parameter()));
    }
  }
  set_values(std::move(values));
}

InputValue GeneratorInputBase::value_of(
    const std::shared_ptr<graph::ParameterContents>& parameter) const {
  InputValue value;
  value.parameter = parameter;
  value.kind = !parameter->is_buffer        ? IOKind::Scalar
               : kind() == IOKind::Function ? IOKind::Function
                                            : IOKind::Buffer;
  if (value.kind == IOKind::Function) value.func = ImageParam(parameter);
  if (value.kind == IOKind::Scalar)
    value.expr = ir::variable(parameter->name, parameter->type, ir::SymbolRef(parameter));
  return value;
}

void GeneratorInputBase::set_values(std::vector<InputValue> values) {
  agree_on_size(values.size());
  for (const InputValue& value : values) {
    if (value.kind != kind()) {
      const char* names[] = {"a scalar", "a Func", "an image"};
      refuse("set", "the value matches the declaration of the input",
             std::string("it declares ") + names[static_cast<int>(kind())] + " and was given " +
                 names[static_cast<int>(value.kind)],
             "Give a value of that kind");
    }
    agree_on(value.types(), value.dims());
  }
  values_ = std::move(values);
  values_changed();
}

void GeneratorInputBase::set_estimate_of(const Var& var, const Expr& min,
                                         const Expr& extent) const {
  for (const InputValue& value : values_) {
    if (!value.parameter) continue;
    const ImageParam image(value.parameter);
    const std::vector<Var> names = Func(image).args();
    size_t d = 0;
    while (d < names.size() && names[d].name() != var.name()) d++;
    if (d == names.size()) {
      const std::string list = listed(names, [](const Var& name) { return quoted(name.name()); });
      refuse("set an estimate of " + quoted(var.name()) + " of",
             "a dimension has the name of one of the input's arguments", "these are " + list,
             "Use one of them, or dim(i).set_estimate()");
    }
    image.dim(static_cast<int>(d)).set_estimate(min, extent);
  }
}

void GeneratorInputBase::check_ready() const {
  if (!values_.empty() || (array_size_defined() && array_size() == 0)) return;
  refuse("use", "inputs have values in generate() and schedule()", "it has none yet",
         "Use it there, and in configure() its declaration only");
}

}  // namespace retrograde::internal
