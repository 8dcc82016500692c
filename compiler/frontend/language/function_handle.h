// function_handle.h -- what a Func is made of, with the questions that a Func answers: for programs
// that take `f.function()` of a Func.
#pragma once

#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "graph/function.h"

namespace retrograde::internal {

class Function : public graph::FuncPtr {
 public:
  Function() = default;
  explicit Function(graph::FuncPtr contents) : graph::FuncPtr(std::move(contents)) {}

  const std::string& name() const { return checked().name; }
  int dimensions() const { return checked().dimensions(); }
  int outputs() const { return static_cast<int>(checked().types.size()); }
  const std::vector<Type>& output_types() const { return checked().types; }
  const std::vector<std::string>& args() const { return checked().args; }
  bool has_pure_definition() const { return checked().is_defined() && !checked().is_extern(); }
  bool has_update_definition() const { return !checked().updates.empty(); }
  bool has_extern_definition() const { return checked().is_extern(); }
  bool is_pure() const { return has_pure_definition() && !has_update_definition(); }
  bool frozen() const { return checked().frozen; }
  // The values of the pure definition; empty without one.
  std::vector<Expr> values() const {
    return has_pure_definition() ? checked().pure->values : std::vector<Expr>();
  }
  const std::vector<Type>& required_types() const { return checked().required_types; }
  int required_dimensions() const { return checked().required_dimensions; }
  bool same_as(const Function& other) const { return get() == other.get(); }

 private:
  // Requires: a Function is that of a Func.
  const graph::FuncContents& checked() const {
    if (const graph::FuncContents* contents = get()) return *contents;
    user_error("look at a Function", "a Function is that of a Func", "this one was made of nothing",
               "Take it from a Func: f.function()");
  }
};

}  // namespace retrograde::internal
