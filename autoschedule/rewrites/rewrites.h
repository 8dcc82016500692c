// rewrites.h -- the Funcs that a plan may need and a program lacks: partial sums and copies of operands.
//
//   program                              with rewrites
//   loss() += e(r.x, r.y)           =>   rows(lane, row) += e(16 t + lane, row)
//                                        groups(lane, group) += rows(lane, 32 s + group)
//                                        loss() += groups(lane, group)
//   mean(y) += f(r, y)              =>   block(y, o) += f(256 o + i, y)
//                                        mean(y) += block(y, o)
//   p(j, i) += a(k, i) * b(j, k)    =>   b_in_p(j, k) = b(j, k)
//                                        p(j, i) += a(k, i) * b_in_p(j, k)
//
// No plan can split a sum or copy an operand, so this happens before. Nothing is said about loops and places: where a
// partial sum runs, and whether a copy is worth its time, is for the search to decide. A copy starts at root, and the
// search may inline it. How sums are split depends on the program alone, never on the machine or the count of
// threads, and so does every bit.
#pragma once

#include <string>
#include <unordered_set>
#include <vector>

#include "autoschedule/rewrites/split_for_device.h"
#include "graph/function.h"

namespace retrograde::planning {

// Which Funcs and rewrites are left out.
struct RewriteOptions {
  bool splits_sums = true, copies_operands = true;
  std::unordered_set<std::string> kept = {};  // names of Funcs that keep their definitions
  SplitForDevice for_device = {};             // what is split instead where a device runs it
};
// The outputs of a copy of the program. Requires: wrappers are applied. Funcs with directives keep their definitions.
// `accesses`: of the program, or of none; afterwards, of one like it.
std::vector<graph::FuncPtr> with_rewrites(const std::vector<graph::FuncPtr>& outputs,
                                          const RewriteOptions& options, AccessGraph& accesses);
inline std::vector<graph::FuncPtr> with_rewrites(const std::vector<graph::FuncPtr>& outputs,
                                                 const RewriteOptions& options = {}) {
  AccessGraph none;
  return with_rewrites(outputs, options, none);
}

}  // namespace retrograde::planning
