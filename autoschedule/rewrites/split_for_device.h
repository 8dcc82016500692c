// split_for_device.h -- sums to few elements, in as many partial sums as keep a device busy.
//
//   loss() += e(r.x, r.y)     =>    parts(u) += e of every 4096th point of the domain, from u on
//                                   groups(v) += parts of every 128th, from v on
//                                   loss() += groups(v)
//
// Each partial sum is a thread. Neighbours take neighbours, unless the order of terms matters, as that of an argmin does
// among equals: then each has a stretch of them. Their number depends on the program and its sizes alone, and so does every
// bit. The same holds for sums at data-dependent indices, if each part has few elements beside what is added to them. Loops
// whose extents are known are split as one; of others, points of rows and rows apart.
#pragma once

#include <vector>

#include "autoschedule/access/dependences.h"
#include "autoschedule/machine/device.h"
#include "graph/function.h"
#include "ir/visit.h"

namespace retrograde::planning {

// Which updates may be split: sums, and sums at data-dependent indices.
struct SplitForDevice {
  const Device* device = nullptr;  // null: the processor runs the program
  bool sums = true, scatters = true;
  Atomics atomics = Atomics::OfIntegers;  // updates that are atomic stay
};
void split_for_device(const std::vector<graph::FuncPtr>& outputs, const SplitForDevice& how,
                      ir::FunctionRef<bool(const graph::FuncContents&)> may_change);

}  // namespace retrograde::planning
