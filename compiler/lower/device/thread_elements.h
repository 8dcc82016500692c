// thread_elements.h -- finds out whether each element of a block's storage belongs to one thread, and renumbers the
// elements of a thread as private storage.
//
// An index must be a sum of loop counters, each multiplied by a factor, and a constant. Counters are those of loops
// over threads and of the loops around and inside them. If every factor exceeds the largest sum of all terms with
// smaller factors, the index determines every counter, like the digits of a number, and so the thread:
//
//   sum[x + 16 * y] with threads x of 16, y of 8:   one element a thread
//   sum[u + 4 * x] with threads x, unrolled u of 4: four elements a thread, numbered by u
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"
#include "lower/device/kernel.h"

namespace retrograde::lower {

struct ThreadElements {
  struct Digit {
    int64_t factor = 1;      // in the index
    int64_t extent = 1;      // number of values
    int thread = -1;         // dimension of the loop over threads; -1: another loop or a constant
    int64_t own_factor = 0;  // in the thread's own numbering
  };
  std::vector<Digit> digits;  // smallest factor first
  int64_t own_count = 1;      // elements of one thread
};

// nullopt if elements cannot be proven to be accessed by one thread each. `kernel`: with the number of threads chosen,
// and with its loops over threads.
std::optional<ThreadElements> find_thread_elements(const Kernel& kernel,
                                                   const std::string& storage);

// Whether each element is proven to be accessed by the threads of a single warp.
bool belongs_to_one_warp(const Kernel& kernel, const std::string& storage);

// The kernel's body in which accesses of `storage` use the thread's own numbering.
Stmt renumbered_privately(const Kernel& kernel, const std::string& storage,
                          const ThreadElements& elements);

}  // namespace retrograde::lower
