// kept_update.h -- finds updates for keep_accumulators: a reduction that updates the same few elements in all
// iterations of its serial loops.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

inline constexpr int64_t register_file = 2048;  // bytes: 32 registers of 64 bytes

inline bool is_lane_loop(const For& loop) {
  return loop.runs == ForType::Vectorized || loop.runs == ForType::Unrolled;
}

// `body` in loops over the lanes, the first one outermost, and in all of the conditions.
Stmt in_lanes(const std::vector<const For*>& lanes, const std::vector<Expr>& conditions, Stmt body);

// The loops and conditions from a serial loop down to the only Provide in it.
struct KeptUpdate {
  std::vector<const For*> lanes;  // outermost first
  std::vector<Expr> conditions;   // that do not depend on the serial loops; lets are expanded
  const Provide* provide = nullptr;
  std::vector<Expr> point;  // coordinates of the Provide; lets are expanded

  // The call, if `e` reads the updated Func itself.
  const Call* as_own(const Expr& e) const {
    const auto* call = e.as<Call>();
    const bool is_own = call && call->call_type == CallType::Func && call->name == provide->name;
    return is_own ? call : nullptr;
  }
};

// The update in a serial loop. nullopt if the loop contains another statement, if the elements change from iteration to
// iteration, or if they do not fit into registers. `is_pure`: whether the iterations of a loop store to different
// elements.
std::optional<KeptUpdate> kept_update(const For& loop,
                                      const std::function<bool(const For&)>& is_pure);

}  // namespace retrograde::lower
