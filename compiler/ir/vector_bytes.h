// vector_bytes.h -- the vector length of a target in bytes.
#pragma once

#include "ir/target.h"

namespace retrograde::ir {

// 64 with AVX-512, 32 with AVX2, else 16, also for an unspecified target.
int vector_bytes(const Target& target);

}  // namespace retrograde::ir
