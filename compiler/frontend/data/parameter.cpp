#include "frontend/data/parameter.h"
#include "frontend/data/serialization.h"

#include "diagnostics/error.h"

namespace retrograde {

Parameter::Parameter(const Type& type, bool is_buffer, int dimensions, const std::string& name) {
  if (is_buffer) {
    const ImageParam image =
        name.empty() ? ImageParam(type, dimensions) : ImageParam(type, dimensions, name);
    contents_ = image.parameter();
    return;
  }
  if (dimensions != 0) {
    user_error("make a Parameter of a scalar", "a scalar has no dimensions",
               text("it was given ", dimensions), "Give 0, or say that it is a buffer");
  }
  contents_ = frontend::make_scalar_parameter(type, name);
}

graph::ParameterContents& Parameter::checked(const char* asked) const {
  if (!contents_) {
    user_error(std::string(asked) + " a Parameter", "it refers to a Param or an ImageParam",
               "it was made without one", "Take it from parameter(), or give it a type");
  }
  return *contents_;
}

graph::ParameterContents& Parameter::checked_scalar(const char* asked) const {
  graph::ParameterContents& contents = checked(asked);
  if (contents.is_buffer) {
    user_error(std::string(asked) + " the Parameter " + quoted(contents.name),
               "this is for scalars", "it is a buffer", "Use buffer() and set_buffer()");
  }
  return contents;
}

ImageParam Parameter::image(const char* asked) const {
  if (!checked(asked).is_buffer) {
    user_error(std::string(asked) + " the Parameter " + quoted(contents_->name),
               "this is for buffers", "it is a scalar", "Use scalar() and set_scalar()");
  }
  return ImageParam(contents_);
}

Expr Parameter::scalar_expr() const {
  return ir::to_expr(frontend::get_scalar(checked_scalar("take the value of"), contents_->type));
}

void Parameter::set_min_value(const Expr& min) {
  frontend::set_limit(checked_scalar("limit"), &graph::ParameterContents::min_value, min);
}
void Parameter::set_max_value(const Expr& max) {
  frontend::set_limit(checked_scalar("limit"), &graph::ParameterContents::max_value, max);
}
void Parameter::set_estimate(const Expr& value) {
  frontend::set_limit(checked_scalar("estimate"), &graph::ParameterContents::estimate, value);
}

}  // namespace retrograde

void retrograde::frontend::refuse_serialization(const char* asked) {
  unsupported(asked, "a pipeline exists only in the process that defines it",
              "a graph of Funcs has no form as bytes",
              "Compile it ahead of time with compile_to_static_library(), or name a folder for the "
              "compile cache");
}
