// vector_bytes.h -- the length of a target's vectors.
#pragma once

#include "ir/target.h"

namespace retrograde::ir {

// 64 with AVX-512, 32 with AVX2, else 16: also of a target that nobody named.
int vector_bytes(const Target& target);

}  // namespace retrograde::ir
