// read_window.h -- which elements along one dimension an index reaches, as one loop of its reader runs:
// of  f(2 y + r)  with r from -1 to 2 those from 2 y - 1 to 2 y + 2.
#pragma once

#include <optional>
#include <string>

#include "graph/function.h"

namespace retrograde::autoschedule {

// From scale * loop + low to scale * loop + high, at most; a bound that holds for all iterations.
struct ReadWindow {
  std::string loop;  // empty: the same for all iterations
  double scale = 0;
  double low = 0, high = 0;

  bool is_same_element() const { return scale == 1 && low == high; }
};

// Of an index in a stage of f. nullopt: data decide it, several loops move it, or its reach is not
// known.
std::optional<ReadWindow> read_window(const Expr& index, const FuncContents& f,
                                      const Definition& stage);

}  // namespace retrograde::autoschedule
