// The static runtime, as bytes.
#pragma once

#include <string>

#include "ir/target.h"

namespace retrograde::aot {

bool has_runtime_object(const Target& target);
// An object file. Unsupported when this build has none for the target.
std::string runtime_object(const Target& target);

}  // namespace retrograde::aot
