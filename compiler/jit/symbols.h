// The functions that generated code may call: the runtime, libm, SLEEF, and those that the program
// names itself, wherever in the process they are.
#pragma once

#include <string>

namespace retrograde::jit {
void* find_symbol(const std::string& name);  // null when there is none
}
