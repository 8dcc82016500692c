// What a derivative by an input looks like: the shape that directions and contributions must have.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

struct InputShape {
  std::string name;
  int dimensions = 0;
  std::vector<Type> types;  // empty: not defined
  bool is_floating() const;
};
// Of a Func, image or parameter; null and others: undefined.
InputShape shape_of(const Symbol* symbol);

bool is_floating(const std::vector<Type>& types);
// CompileError unless some value is a float. `whose`: the message's subject, as "its type".
void check_is_floating(const std::string& asked, const std::vector<Type>& types,
                       const std::string& whose, const std::string& what_to_do);

// CompileError unless `given` is defined, with the dimensions and the number of values of `shape`,
// all of them floats. `what`: "a direction"; `of`: what the message calls the input.
void check_shape(const std::string& asked, const std::string& what, const std::string& of,
                 const InputShape& shape, const FuncContents& given);

}  // namespace retrograde::autodiff
