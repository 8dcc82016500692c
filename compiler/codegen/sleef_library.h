// sleef_library.h -- SLEEF's functions in this process.
#pragma once

namespace retrograde::codegen {

// nullptr: there is no such function.
void* find_in_sleef(const char* name);

}  // namespace retrograde::codegen
