// param.cpp -- values and limits of scalar parameters.
#include "frontend/param.h"

#include <cmath>

#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

std::string value_text(const Scalar& value) {
  if (value.type.is_float()) return text(value.f);
  return value.type.is_int() ? text(value.i) : text(value.u);
}

bool holds(Type type, const Scalar& value) {
  if (type.is_handle() || value.type.is_handle()) return type.is_handle() == value.type.is_handle();
  if (value.type.is_float()) {
    // Floats may round; an integer parameter takes whole numbers only.
    if (type.is_float()) return std::isfinite(value.f) ? type.can_represent(value.f) : true;
    return value.f == std::floor(value.f) && type.can_represent(value.f);
  }
  if (type.is_float()) return eval_cast(type, value).f == value.as_double();
  return value.type.is_int() ? type.can_represent(value.i) : type.can_represent(value.u);
}

}  // namespace

std::shared_ptr<ParameterContents> make_scalar_parameter(Type type, const std::string& name) {
  auto result = std::make_shared<ParameterContents>();
  result->name = name.empty() ? unique_name("p") : claim_parameter_name(name);
  result->type = type;
  if (type.bits() == 0 || !type.is_scalar()) {
    user_error("make the Param " + quoted(result->name), "its type is a scalar",
               "it is " + to_string(type));
  }
  return result;
}

Scalar converted_scalar(const ParameterContents& parameter, const Scalar& value) {
  if (!holds(parameter.type, value)) {
    user_error(text("set the Param ", quoted(parameter.name), " to ", value_text(value)),
               "the value must fit the parameter's type",
               "its type is " + to_string(parameter.type), "Give a value of that type");
  }
  return parameter.type.is_handle() ? value : eval_cast(parameter.type, value);
}

void set_scalar(ParameterContents& parameter, const Scalar& value) {
  parameter.value = converted_scalar(parameter, value);
}

void set_limit(ParameterContents& parameter, Expr ParameterContents::*field, const Expr& value) {
  if (value.defined() && value.type().is_handle()) {
    user_error("limit the Param " + quoted(parameter.name), "limits are numbers",
               text("one is ", value));
  }
  parameter.*field = value.defined() ? cast_to(parameter.type, value) : value;
  parameter.version++;
}

Scalar get_scalar(const ParameterContents& parameter, Type type) {
  const std::string asked = "get the value of the Param " + quoted(parameter.name);
  if (!parameter.value)
    user_error(asked, "a value must have been set", "it has none", "Call set() first");
  if (type != parameter.type) {
    user_error(text(asked, " as ", to_string(type)), "the types must agree",
               "it is of type " + to_string(parameter.type));
  }
  return *parameter.value;
}

}  // namespace retrograde::ir
