// function_handle.h -- what a Func is made of, with the questions that a Func answers: for programs
// that take `f.function()` of a Func.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::internal {

class Function : public graph::FuncPtr {
 public:
  Function() = default;
  explicit Function(graph::FuncPtr contents) : graph::FuncPtr(std::move(contents)) {}

  const std::string& name() const { return get()->name; }
  int dimensions() const { return get()->dimensions(); }
  int outputs() const { return static_cast<int>(get()->types.size()); }
  const std::vector<Type>& output_types() const { return get()->types; }
  const std::vector<std::string>& args() const { return get()->args; }
  bool has_pure_definition() const { return get()->is_defined() && !get()->is_extern(); }
  bool has_update_definition() const { return !get()->updates.empty(); }
  bool has_extern_definition() const { return get()->is_extern(); }
  bool is_pure() const { return has_pure_definition() && !has_update_definition(); }
  bool frozen() const { return get()->frozen; }
  // Of the first definition; none without.
  std::vector<Expr> values() const {
    return has_pure_definition() ? get()->pure->values : std::vector<Expr>();
  }
  const std::vector<Type>& required_types() const { return get()->required_types; }
  int required_dimensions() const { return get()->required_dimensions; }
  bool same_as(const Function& other) const { return get() == other.get(); }
};

}  // namespace retrograde::internal
