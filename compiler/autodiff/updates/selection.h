// Updates that keep either the old value or a new one: max, min, argmax, argmin, and selects like
// them.
#pragma once

#include <optional>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// winner runs the update again and remembers the number of the iteration that wrote each element
// last, -1: none.
struct Selection {
  FuncPtr winner;
  int index_value;          // which value of `winner` is that number
  std::vector<Expr> taken;  // per value of f: what is taken; undefined: the value is never changed
};
std::optional<Selection> find_selection(const FuncPtr& f, int stage);

}  // namespace retrograde::autodiff
