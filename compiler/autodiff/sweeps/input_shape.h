// input_shape.h -- the shape that directions and contributions for an input must have, and checks of it.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

struct InputShape {
  std::string name;
  int dimensions = 0;
  std::vector<Type> types;  // empty: undefined
  bool is_floating() const;
};
// The shape of a Func, image or parameter; undefined for null and other symbols.
InputShape shape_of(const Symbol* symbol);

bool is_floating(const std::vector<Type>& types);
// Throws CompileError unless some value is a float. `whose` is the message's subject, for example "its type".
void check_is_floating(const std::string& asked, const std::vector<Type>& types,
                       const std::string& whose, const std::string& what_to_do);
// Throws CompileError unless the output of a derivative is defined and floating.
void check_output(const std::string& asked, const FuncContents& output,
                  const std::string& what_to_do);

// Throws CompileError unless `candidate` is defined and has the dimensions and number of values of `shape`, all floats.
// `what` names `candidate` in the message, for example "a direction"; `of` names the input.
void check_shape(const std::string& asked, const std::string& what, const std::string& of,
                 const InputShape& shape, const FuncContents& candidate);

}  // namespace retrograde::autodiff
