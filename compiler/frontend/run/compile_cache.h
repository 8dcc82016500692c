// compile_cache.h -- a cache of compiled pipelines on disk.
#pragma once

#include <cstdint>
#include <string>

namespace retrograde {

// Default size limit of the compile cache: 1 GB.
constexpr int64_t default_compile_cache_bytes = 1000000000;

// Keeps the machine code of later realize() calls in `folder`, for this process and later ones. An empty
// string turns the cache off. A missing folder is created. If the files exceed `max_bytes`, the least recently
// used ones are removed. The environment variables RETROGRADE_CACHE_DIR and RETROGRADE_CACHE_MB (millions of
// bytes) do the same.
// Requires: its folder must be writable; RETROGRADE_CACHE_MB is a whole number of megabytes, 1 or
// more; its size in bytes is positive; its folder belongs to the user alone (mode 0700).
void set_compile_cache_directory(const std::string& folder,
                                 int64_t max_bytes = default_compile_cache_bytes);

}  // namespace retrograde
