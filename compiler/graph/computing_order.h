// computing_order -- chooses the order of the loop nests at root so that few intermediate images
// are alive at once. Producers always come before their consumers.
//
//   temp; out_1 reads temp; other; out_2 reads other      not      temp; other; out_1; out_2
//   a; b; c; d; sum reads a, b, c, d; e reads d           not      a; b; c; d; e; sum
//
// Two kinds of nests run as soon as their producers are done. An output allocates nothing, since
// its buffer is the caller's. Running it early frees the intermediates that only it reads, while
// they are still in the caches. A nest that reads many others of its size allocates one image and
// may free many.
//
// The default is the order in which the graph's first output needs the nests. Another output may
// come first if that keeps far fewer Funcs alive. For example, one output may need the forward
// values of all steps of an iteration and another only the adjoints.
//
// Loop nests and the estimate of memory both follow this order. Not done: an order by bytes, which
// are unknown when loops are built. Finding the best order is NP-hard (Sethi, Complete Register
// Allocation Problems, SIAM J. Computing 1975).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace retrograde::graph {

// A Func with loops of its own. Inlined Funcs are part of their consumers.
struct ComputedFunc {
  std::vector<size_t> callees;  // indices of Funcs, each less than the Func's own
  std::optional<size_t> host;   // the Func in whose loops it is computed; none: at root
  size_t dimensions = 0;
  bool is_output = false;
};

// Indices of the Funcs in the order in which they are computed.
std::vector<size_t> computing_order(const std::vector<ComputedFunc>& funcs);

}  // namespace retrograde::graph
