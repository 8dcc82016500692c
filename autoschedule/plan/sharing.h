// sharing.h -- whether stages may run in each other's loops (P7).
#pragma once

#include <string>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The first rule that loops of several stages break; empty: none. Requires: the loops exist.
//
//   The stages are computed at one place, and the loops that they share are of one kind. No stage shares its own
//   loops through others. A Func is placed in shared loops by the name of the Func that owns them. All stages of Funcs that share loops can run together: none of these Funcs depends on another,
//   also through Funcs that run with others, and the stages of each run in their order.
// `before`: null, or a plan that breaks none.
std::string broken_sharing(const Plan& plan, const Plan* before);

}  // namespace retrograde::planning
