// kept_update.h -- what keep_accumulators keeps in registers: the elements that one update adds to while
// its serial loops run.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

inline constexpr int64_t register_file = 2048;  // bytes: 32 registers of 64

inline bool is_lane_loop(const For& loop) {
  return loop.runs == ForType::Vectorized || loop.runs == ForType::Unrolled;
}

// The way from a serial loop to the one Provide in it.
struct KeptUpdate {
  std::vector<const For*> lanes;  // outermost first
  std::vector<Expr> conditions;   // that are the same for all iterations; lets are substituted
  const Provide* provide = nullptr;
  std::vector<Expr> point;  // of the Provide; lets are substituted

  // A value of its Func.
  const Call* as_own(const Expr& e) const {
    const auto* call = e.as<Call>();
    const bool is_own = call && call->call_type == CallType::Func && call->name == provide->name;
    return is_own ? call : nullptr;
  }
};

// Of a serial loop; nullopt: there is another statement in it, or what is stored changes from iteration
// to iteration, or does not fit registers. `is_pure`: whether the iterations of a loop store to
// different elements.
std::optional<KeptUpdate> kept_update(const For& loop,
                                      const std::function<bool(const For&)>& is_pure);

}  // namespace retrograde::lower
