// time_steps.h -- finds Funcs whose last stage is a loop over steps: each iteration stores the next slice of one
// dimension, "time", from the slices right before it.
//
//   produce u {
//     for t, y, x: u(x, y, t) = start(x, y)                     earlier stages
//     for (r, 0, n): for y, x: u(x, y, r + 1) = g(u(.., r))     the steps
//   }
//   consume u { last(x, y) = u(x, y, n) }
//
// Found are the number of slices that must exist at once, and what the earlier stages contribute to a slice, so that
// they can run for one slice at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::lower {

inline constexpr int64_t most_step_slots = 16;  // slices that are kept at most

// A stage before the steps. It stores to the slice sign * over_time + offset in each iteration of that loop, or, if
// there is no such loop, to the slice `offset`.
struct EarlierStage {
  Stmt nest;
  const For* over_time = nullptr;
  int sign = 1;
  Expr offset;
};

// When the earlier stages must run for the slices that the steps store.
enum class SliceStart : uint8_t {
  Never,       // the slices before the first step have all values that remain
  FirstSteps,  // until each slot has had its values once
  EveryStep,
};

struct TimeSteps {
  size_t dimension = 0;
  int sign = 1;                   // direction of time
  const Block* stages = nullptr;  // the earlier stages and, last, the steps
  const For* loop = nullptr;      // over the steps
  Expr time;  // the slice that an iteration stores, in terms of the loop's variable
  std::vector<EarlierStage> earlier;
  SliceStart start = SliceStart::EveryStep;
  int64_t slots = 0;  // how many consecutive slices are alive at once; 0: unknown
};

// `lets`: the names around the Realize with their expanded values. nullopt if its Func has no such steps.
std::optional<TimeSteps> find_time_steps(const Realize& f, const Substitution& lets);

// The slice that is stored in the given iteration.
Expr time_at(const TimeSteps& steps, const Expr& iteration);

}  // namespace retrograde::lower
