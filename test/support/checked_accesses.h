// Enables checked accesses (Target::CheckedAccesses) for all code that the including program compiles, unless
// RG_JIT_TARGET names a target.
#pragma once

#include <cstdlib>

namespace retrograde {

inline const bool checks_accesses = setenv("RG_JIT_TARGET", "host-checked_accesses", 0) == 0;

}  // namespace retrograde
