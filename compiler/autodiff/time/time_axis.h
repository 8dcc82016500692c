// A Func that keeps every step of a recurrence along a dimension of its own, the time axis, while
// others read the last ones only:
//   f(x, t) = start(x, t);   f(x, r + 1) = g(f(x, r), ..., f(x, r - m + 1));   ... f(x, n) ...
#pragma once

#include <optional>
#include <vector>

#include "autodiff/updates/update_context.h"

namespace retrograde::autodiff {

struct TimeAxis {
  size_t dim = 0;
  int sign = 1;      // -1: time runs backward
  Expr first, last;  // times that the update writes
  int lag = 0;       // a step reads at most so far back
  int slots = 0;     // slices that a step and the readers need
  // Of each read by the update, in the order of UpdateContext::self_reads(): where it sees what is
  // in a slot; elsewhere the pure definition, which no step overwrote.
  std::vector<Expr> in_slot;
  Expr ever_written;  // over f's variables without time: elements that steps write
};

// That of the last update of c.f; nullopt: it has none, or somebody in `order` reads more of it.
std::optional<TimeAxis> find_time_axis(const UpdateContext& c, const std::vector<FuncPtr>& order);

}  // namespace retrograde::autodiff
