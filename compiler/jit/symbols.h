// The functions that generated code may call: the runtime, libm, SLEEF; nothing else of the
// process.
#pragma once

#include <string>

namespace retrograde::jit {
void* find_symbol(const std::string& name);  // null when there is none
}
