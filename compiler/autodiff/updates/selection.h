// selection.h -- recognises updates that keep either the old value or a new one: max, min, argmax, argmin and such
// selects.
#pragma once

#include <optional>
#include <vector>

#include "graph/function.h"

namespace retrograde::autodiff {

// `winner` runs the update again and stores, for each element, the number of the iteration that wrote it last; -1 for
// none.
struct Selection {
  FuncPtr winner;
  int index_value;          // the value of the Tuple `winner` that holds the number
  std::vector<Expr> taken;  // for each value of f: the new value; undefined: never changed
};
std::optional<Selection> find_selection(const FuncPtr& f, int stage);

}  // namespace retrograde::autodiff
