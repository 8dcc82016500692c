// computing_order -- in which order loop nests at root run, of those in which producers come first: one
// in which little is alive at once.
//
//   temp; out_1 reads temp; other; out_2 reads other      not      temp; other; out_1; out_2
//   a; b; c; d; sum reads a, b, c, d; e reads d           not      a; b; c; d; e; sum
//
// An output's memory is its caller's, whenever it is computed; what only the output reads is free
// after it, and still in the caches before. Who reads many others that are as large takes one place
// where these may leave many. Both are computed as soon as what they read is there.
//
// The order of the graph is that in which its first output needs it. Where others first would keep far
// fewer Funcs at once, as where one needs the forward values of all steps of an iteration and another
// only the adjoints, their order is taken.
//
// Lowering follows this order, and what estimates its memory asks for it.
// Not done: an order by bytes (which lowering does not know); the best one is NP-hard to find
// (Sethi, Complete Register Allocation Problems, SIAM J. Computing 1975).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace retrograde::graph {

// What has loops of its own; what is computed inline stands in its readers.
struct ComputedFunc {
  std::vector<size_t> callees;  // numbers, each less than the Func's own
  std::optional<size_t> host;   // in whose loops it is computed; none: at root
  size_t dimensions = 0;
  bool is_output = false;
};

// Numbers of the Funcs, in the order in which they are computed.
std::vector<size_t> computing_order(const std::vector<ComputedFunc>& funcs);

}  // namespace retrograde::graph
