// row_guests.h -- sums for other elements join the loop over rows of a host, and what all of these read is computed in it.
//
//   adj(x, y, c, n) = ...                                              larger than caches
//   mean_adj(g, n) += adj(r.x, r.y, 8 g + r.z, n)                      a member (row_hosts.h)
//   in_adj(x, y, c, n) = adj(x, y, c, n) + mean_adj(c / 8, n)          the host
//   scale_adj_parts(lane, c, n) += adj(..., c, n) * in(..., c, n)      a guest: the private parts of a sum over n
//
//   parallel n, for c, y, x: adj = ...            parallel n, for each 8 values of c:
//   parallel n, for each 8 values of c:             for these c, for y, x: adj = ...
//     mean_adj = ...                        =>      mean_adj = ...
//     for these c, for y, x: in_adj = ...           for these c, for y, x: in_adj = ...
//   parallel n, for c: scale_adj_parts = ...        for these c: scale_adj_parts = ...
//
// A row comes from memory once, and what was stored as a whole and loaded by each goes neither way. The host has the
// loops, and guests share them (compute_with).
//
// 1. A guest reads something at the rows at which the host reads it, and it is the private parts of an adjoint: others
//    add to other elements at the same time.
// 2. Its variables name the row: each element belongs to one row.
// 3. Neither the host nor another guest needs it, nor does it need these.
// 4. What is computed inside is read by the host, its members and guests alone, by the host at its own element, and
//    by members within their row.
// Not done: parts of several planes each; reads of neighbouring rows.
// Tests: test/autoschedule/row_guests_test.cpp.
#pragma once

#include <functional>
#include <vector>

#include "autoschedule/row_hosts.h"
#include "autoschedule/size_estimate.h"
#include "autoschedule/stored_reads.h"

namespace retrograde::autoschedule {

// Adds guests and what is computed inside to a host with members. `is_free`: what may have such a role.
void add_row_guests(RowHost& host, const std::vector<FuncPtr>& stored, const StoredReads& reads,
                    const std::function<bool(const FuncPtr&)>& is_free, const SizeEstimate& sizes);

// Loops that leave those over rows whole.
void give_loops_of_guest(const RowGuest& guest, const GiveLoopsOfStage& give,
                         const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
