// function_handle.h -- internal::Function, for programs that inspect a Func through f.function(), as in Halide.
#pragma once

#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "graph/function.h"

namespace retrograde::internal {

// A read-only view of a Func's contents, as f.function() returns it.
class Function : public graph::FuncPtr {
 public:
  Function() = default;  // an empty view
  // A view of an existing function.
  explicit Function(graph::FuncPtr contents) : graph::FuncPtr(std::move(contents)) {}

  const std::string& name() const { return checked().name; }  // the unique name
  int dimensions() const { return checked().dimensions(); }   // number of coordinates
  // Number of values.
  int outputs() const { return static_cast<int>(checked().types.size()); }
  // Types of the values.
  const std::vector<Type>& output_types() const { return checked().types; }
  // Names of the coordinates.
  const std::vector<std::string>& args() const { return checked().args; }
  // Whether it has a pure definition that is not extern.
  bool has_pure_definition() const { return checked().is_defined() && !checked().is_extern(); }
  // Whether it has updates.
  bool has_update_definition() const { return !checked().updates.empty(); }
  // Whether a C function computes it.
  bool has_extern_definition() const { return checked().is_extern(); }
  // Whether it has a pure definition and no updates.
  bool is_pure() const { return has_pure_definition() && !has_update_definition(); }
  bool frozen() const { return checked().frozen; }  // whether it accepts no more definitions
  // Right-hand sides of the pure definition; empty without one.
  std::vector<Expr> values() const {
    return has_pure_definition() ? checked().pure->values : std::vector<Expr>();
  }
  // Types that definitions must have; empty if none were declared.
  const std::vector<Type>& required_types() const { return checked().required_types; }
  // Rank that definitions must have; negative if none was declared.
  int required_dimensions() const { return checked().required_dimensions; }
  // Whether both refer to one function.
  bool same_as(const Function& other) const { return get() == other.get(); }

 private:
  // Requires: a Function belongs to a Func.
  const graph::FuncContents& checked() const {
    if (const graph::FuncContents* contents = get()) return *contents;
    user_error("look at a Function", "a Function belongs to a Func", "this one is empty",
               "Take it from a Func: f.function()");
  }
};

}  // namespace retrograde::internal
