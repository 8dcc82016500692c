// param.cpp -- values and limits of scalar parameters.
#include "frontend/data/param.h"

#include "graph/definitions/define.h"
#include "graph/definitions/definition_rules.h"
#include "ir/literal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::frontend {

std::shared_ptr<ParameterContents> make_scalar_parameter(Type type, const std::string& name) {
  auto result = std::make_shared<ParameterContents>();
  result->name = name.empty() ? unique_name("p") : claim_parameter_name(name);
  result->type = type;
  if (type.bits() == 0 || !type.is_scalar()) {
    user_error("make the Param " + quoted(result->name), "its type is a scalar",
               "it is " + to_string(type), "Give a type of one number");
  }
  return result;
}

Scalar converted_scalar(const ParameterContents& parameter, const Scalar& value) {
  if (!holds_value(parameter.type, value)) {
    user_error(text("set the Param ", quoted(parameter.name), " to ", literal_text(value)),
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
               text("one is ", value), "Give numbers");
  }
  const std::string asked = "limit the Param " + quoted(parameter.name);
  if (value.defined()) check_over_parameters(value, "a limit", asked);
  parameter.*field = value.defined() ? literal_in(parameter.type, value, asked,
                                                  "a limit is a value of the parameter's type")
                                     : value;
  parameter.version++;
}

Scalar get_scalar(const ParameterContents& parameter, Type type) {
  const std::string asked = "get the value of the Param " + quoted(parameter.name);
  if (!parameter.value)
    user_error(asked, "a value must have been set", "it has none", "Call set() first");
  if (type != parameter.type) {
    user_error(text(asked, " as ", to_string(type)), "the types must agree",
               "it is of type " + to_string(parameter.type), "Use it with its own type");
  }
  return *parameter.value;
}

}  // namespace retrograde::frontend
