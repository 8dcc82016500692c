// device_buffers.h -- memory of the host and of the device hold the same where it is needed.
//
// Storage that kernels touch is a halide_buffer_t, whose flags say which side has changed it. A launch
// brings to the device what the host has changed; where the host reads or stores what a kernel may have
// stored, a call brings it back first, and what the host stores is marked. Flags decide when the program
// runs: nothing is copied that has not changed.
//
//   allocate f[n] {                           allocate f[n] {
//     launch k { f[..] = .. }                   let f.buffer = retrograde_device_buffer(&f[0], n, type)
//     for ... { g[..] = f[..] }        =>       launch k { f[..] = .. }
//   }                                           retrograde_to_host(f.buffer)
//                                               for ... { g[..] = f[..] }
//                                               retrograde_device_buffer_free(f.buffer)
//                                             }
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// In: with launches. `arguments`: names of buffers that the function is given.
Stmt keep_both_sides(const Stmt& s, const std::vector<std::string>& arguments);

}  // namespace retrograde::lower
