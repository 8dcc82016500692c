// time_axis.h -- finds the time axis of a Func: the dimension along which a recurrence keeps every step, while other
// Funcs read the last steps only.
//
//   f(x, t) = start(x, t);   f(x, r + 1) = g(f(x, r), ..., f(x, r - m + 1));   ... f(x, n) ...
#pragma once

#include <optional>
#include <vector>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

struct TimeAxis {
  size_t dim = 0;
  int sign = 1;      // -1: time runs backward
  Expr first, last;  // first and last time that the update writes
  int lag = 0;       // how far back a step reads at most
  int slots = 0;     // number of slices that a step and the consumers need
  // For each read by the update, in the order of UpdateContext::self_reads(): the condition under which it reads a
  // slot. Else it reads the pure definition, which no step overwrote.
  std::vector<Expr> in_slot;
  Expr ever_written;  // condition over f's variables without time: a step writes the element
};

// The time axis of the last update of c.f; nullopt if it has none, or if a Func in `order` reads further back.
std::optional<TimeAxis> find_time_axis(const UpdateContext& c, const std::vector<FuncPtr>& order);

}  // namespace retrograde::autodiff
