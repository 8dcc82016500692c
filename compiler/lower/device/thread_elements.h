// thread_elements.h -- which elements of storage that a block has a thread touches: whether each
// element is one thread's alone, and how a thread may number its own.
//
// An index is a sum of places in loops, each times a factor, and a constant: of the loops over threads
// and of those in and around them. Where every factor exceeds what all smaller ones can add up to, an
// element tells all the places, as a number tells its digits, and with them the thread:
//
//   sum[x + 16 * y] with threads x of 16, y of 8:   one element a thread
//   sum[u + 4 * x] with threads x, unrolled u of 4: four elements a thread, which it numbers by u
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"
#include "lower/device/kernel.h"

namespace retrograde::lower {

struct ThreadElements {
  struct Digit {
    int64_t factor = 1;  // of the index
    int64_t extent = 1;  // places that there are
    int thread = -1;     // dimension of the loop over threads; -1: of another loop, or constants
    int64_t own_factor = 0;  // of the thread's own number
  };
  std::vector<Digit> digits;  // the smallest factor first
  int64_t own_count = 1;      // elements that a thread has
};

// Null where it is not known that each element is touched by one thread alone. `kernel`: with threads
// chosen, and its loops over threads.
std::optional<ThreadElements> find_thread_elements(const Kernel& kernel,
                                                   const std::string& storage);

// Whether each element is known to be touched by the threads of one warp alone.
bool is_one_warps(const Kernel& kernel, const std::string& storage);

// The kernel's body with the accesses of `storage` by the thread's own numbers.
Stmt in_own_numbers(const Kernel& kernel, const std::string& storage,
                    const ThreadElements& elements);

}  // namespace retrograde::lower
