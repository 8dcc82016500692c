// compile_cache.h -- compiled pipelines kept on disk.
#pragma once

#include <string>

namespace retrograde {

// From now on realize() keeps the machine code of what it compiles in this folder, and takes it
// from there in later runs. Empty: no longer. The folder is made when it is missing; CompileError
// when it is not the user's own (mode 0700). The environment's RETROGRADE_CACHE_DIR does the same.
void set_compile_cache_directory(const std::string& folder);

}  // namespace retrograde
