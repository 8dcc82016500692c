// compile_cache.h -- compiled pipelines kept on disk.
#pragma once

#include <cstdint>
#include <string>

namespace retrograde {

constexpr int64_t default_compile_cache_bytes = 1000000000;

// From now on realize() keeps the machine code of what it compiles in this folder, and takes it
// from there in later runs. Empty: no longer. The folder is made when it is missing. When its files
// take more than `max_bytes`, those that were not used for longest are removed. The environment's
// RETROGRADE_CACHE_DIR does the same, with RETROGRADE_CACHE_MB (millions of bytes) for its size.
// Requires: its folder must be writable; RETROGRADE_CACHE_MB is a whole number of megabytes, 1 or
// more; its size in bytes is positive; its folder belongs to the user alone (mode 0700).
void set_compile_cache_directory(const std::string& folder,
                                 int64_t max_bytes = default_compile_cache_bytes);

}  // namespace retrograde
