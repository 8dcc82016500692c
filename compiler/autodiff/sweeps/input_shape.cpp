#include "autodiff/sweeps/input_shape.h"

#include <algorithm>

#include "diagnostics/error.h"

namespace retrograde::autodiff {

bool is_floating(const std::vector<Type>& types) {
  return std::ranges::any_of(types, [](Type t) { return t.is_float(); });
}

bool InputShape::is_floating() const { return autodiff::is_floating(types); }

void check_is_floating(const std::string& asked, const std::vector<Type>& types,
                       const std::string& whose, const std::string& what_to_do) {
  if (is_floating(types)) return;
  user_error(asked, "only floating-point values have derivatives",
             text(whose, " ", to_string(types[0])), what_to_do);
}

void check_output(const std::string& asked, const FuncContents& output,
                  const std::string& what_to_do) {
  if (!output.is_defined()) {
    user_error(asked, "the output must be defined", "it has no definition", "Define it first");
  }
  check_is_floating(asked, output.types, "its type is", what_to_do);
}

InputShape shape_of(const Symbol* symbol) {
  if (const auto* p = dynamic_cast<const ParameterContents*>(symbol))
    return {p->name, p->is_buffer ? p->dimensions : 0, {p->type}};
  const auto* f = dynamic_cast<const FuncContents*>(symbol);
  if (!f) return {};
  if (!f->is_defined()) return {f->name, 0, {}};
  return {f->name, f->dimensions(), f->types};
}

void check_shape(const std::string& asked, const std::string& what, const std::string& of,
                 const InputShape& shape, const FuncContents& candidate) {
  if (!candidate.is_defined()) {
    user_error(asked, text(what, " must be defined"),
               text("that of ", quoted(shape.name), " has no definition"),
               "Define it before it is given");
  }
  if (candidate.dimensions() != shape.dimensions) {
    user_error(asked, text(what, " has the dimensions of ", of),
               text(quoted(candidate.name), " has ", candidate.dimensions(), " and ",
                    quoted(shape.name), " has ", shape.dimensions),
               text("Define ", what, " over the same dimensions"));
  }
  if (candidate.types.size() != shape.types.size()) {
    user_error(asked, text(what, " has as many values as ", of),
               text(quoted(candidate.name), " has ", candidate.types.size(), " and ",
                    quoted(shape.name), " has ", shape.types.size()),
               "Define it as a Tuple of as many values");
  }
  for (Type t : candidate.types) {
    if (t.is_float()) continue;
    user_error(asked, text(what, " is made of floating-point values"),
               text(quoted(candidate.name), " has type ", to_string(t)), "Convert them to float");
  }
}

}  // namespace retrograde::autodiff
