// Identities and update chains of the operators by which vectors are reduced.
#pragma once

#include <optional>

#include "ir/atomic_update.h"

namespace retrograde::lower {

// x op identity == x, bit for bit; a broadcast when the type has lanes.
Expr identity_of(Kind op, Type type);
// The chain of updates that the store applies to its own element, if it has one operator and no predicate.
std::optional<UpdateChain> find_vector_reduction(const Store& store);

}  // namespace retrograde::lower
