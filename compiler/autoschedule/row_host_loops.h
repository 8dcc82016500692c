// row_host_loops.h -- the loops over rows of a host, and what is computed in them (row_hosts.h).
#pragma once

#include "autoschedule/machine/reference.h"
#include "autoschedule/row_hosts.h"
#include "autoschedule/size_estimate.h"

namespace retrograde::autoschedule {

// On any number of threads: results may not depend on it.
inline constexpr int64_t enough_rows = 2 * planning::reference_tasks;

// Moves the members and what is inside into the loops, and joins copies and guests to them. All have loops of their
// own, the host plain rows.
void move_into_rows(const RowHost& host, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
