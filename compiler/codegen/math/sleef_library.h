// sleef_library.h -- finds SLEEF's functions in this process.
#pragma once

namespace retrograde::codegen {

// nullptr if there is no such function.
void* find_in_sleef(const char* name);

}  // namespace retrograde::codegen
