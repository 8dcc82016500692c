// device_buffers.h -- inserts the copies between host and device memory that a program with kernels needs.
//
// Each allocation that kernels access is a halide_buffer_t, whose flags say which side has changed it. A launch copies
// to the device what the host has changed. Before the host accesses storage that a kernel may have stored to, a
// call copies it back; host stores set the host flag. The flags are tested at run time, so unchanged storage is
// not copied.
//
//   allocate f[n] {                           allocate f[n] {
//     launch k { f[..] = .. }                   let f.buffer = retrograde_device_buffer(&f[0], n, type)
//     for ... { g[..] = f[..] }        =>       launch k { f[..] = .. }
//   }                                           retrograde_to_host(f.buffer)
//                                               for ... { g[..] = f[..] }
//                                               retrograde_device_buffer_free(f.buffer)
//                                             }
//
// An output that kernels overwrite completely before anything reads it is not copied to the device first:
//
//   produce out { launch k { out[..] = .. } }  =>  let out.overwritten = retrograde_overwrite_begin(out.buffer,
//                                                                          1, pack(in.buffer))
//                                                  produce out { launch k { out[..] = .. } }
//                                                  retrograde_overwrite_end(out.overwritten)
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

struct GivenBuffers {
  std::vector<std::string> names;
  // For each Func whose first stage stores every element: the buffers of its values.
  std::map<std::string, std::vector<std::string>> overwritten;
};

// In: a statement with launches. `given`: the buffer arguments of the function.
Stmt insert_device_transfers(const Stmt& s, const GivenBuffers& given);

}  // namespace retrograde::lower
