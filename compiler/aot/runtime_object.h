// The static runtime as an object file in memory.
#pragma once

#include <string>

#include "ir/target.h"

namespace retrograde::aot {

bool has_runtime_object(const Target& target);
// Returns an object file. Unsupported if this build has none for the target.
std::string runtime_object(const Target& target);

}  // namespace retrograde::aot
