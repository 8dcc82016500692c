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
//
// An output that kernels store into whole before anything reads it is not copied to the device first:
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
  // By Func, those of its values: where its first stage stores each element of them.
  std::map<std::string, std::vector<std::string>> overwritten;
};

// In: with launches. `given`: the buffers that the function is given.
Stmt keep_both_sides(const Stmt& s, const GivenBuffers& given);

}  // namespace retrograde::lower
