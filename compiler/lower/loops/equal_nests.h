// equal_nests -- loop nests that are equal up to names are lowered once.
//
//   produce f { nest over f, a }        produce f { nest over f, a }
//   produce g { nest over g, b }   =>   produce g { evaluate equal_nest("f", "f", g[0], "a", b[0]) }
//
// share_equal_nests replaces the later nest by a stand-in, a call that names the earlier one and the memory that stands
// for its memory. The passes in between see the first nest only. expand_equal_nests then copies what has become of it.
// Steps of an unrolled loop over time, and their adjoints, take the compile time of one step this way.
//
// A nest must be at root, under the same conditions as the earlier one: what passes know at the earlier one also holds
// at the later one. Names of scalars must be equal. Memory must be the same, or two allocations of one type and size. A
// buffer of the caller may be accessed at a constant distance: parameters or samples by the number of a step.
#pragma once

#include "ir/expr.h"

namespace retrograde::lower {

// FlatStorage -> the same phase.
Stmt share_equal_nests(const Stmt& s);
// FlatStorage or Vector -> the same phase. No stand-in is left.
Stmt expand_equal_nests(const Stmt& s);

}  // namespace retrograde::lower
