// Programs that include this check the accesses of what they compile (Target::CheckedAccesses), unless RG_JIT_TARGET
// names a target of its own.
#pragma once

#include <cstdlib>

namespace retrograde {

inline const bool checks_accesses = setenv("RG_JIT_TARGET", "host-checked_accesses", 0) == 0;

}  // namespace retrograde
