// step_nests.h -- finds the step after which each iteration of a nest can run, given when slices are finished.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "lower/loops/let_values.h"
#include "lower/loops/time_steps.h"

namespace retrograde::lower {

// The slices of a Func along its time: slice u is finished in the step sign * (u - offset).
struct Slices {
  size_t dimension = 0;
  int sign = 1;
  Expr offset;
  int64_t most_age = 0;  // in steps, of a slice that a step reads
  bool is_read_later = false;
};

using SlicesByFunc = std::map<std::string, Slices>;

// A nest that runs after the step `iteration` = sign * (its loop over time) + offset; `over_time` is null for a nest
// that runs once, after the step `offset`.
struct StepNest {
  std::string func;
  Stmt nest;
  const For* over_time = nullptr;
  int sign = 1;
  Expr offset;
};

// The nest of a Func, which reads slices, in a loop over steps. Notes the ages of the slices that it reads, and the slices
// that it stores. nullopt if it cannot run in the steps.
std::optional<StepNest> find_step_nest(const std::string& func, const Stmt& nest, const For& loop,
                                       const LetValues& value, SlicesByFunc& slices);

}  // namespace retrograde::lower
