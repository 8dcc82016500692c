// Finds the functions that generated code may call: the runtime's, libm's, SLEEF's, and those that the program names,
// anywhere in the process.
#pragma once

#include <string>

namespace retrograde::jit {
void* find_symbol(const std::string& name);  // null if there is none
}
