// The cache of memoized Funcs by HalideRuntime.h.
//
// A lookup allocates memory for each buffer, which the caller frees by release. It is either filled from the cache or
// to be filled by the caller. The cache holds copies, so evicting an entry invalidates nothing. Regions are part of an
// entry's key, because Halide's keys do not contain them.
#include <cstring>
#include <string>
#include <vector>

#include "halide/weak.h"
#include "retrograde_runtime.h"

namespace {

void add(std::string& key, const halide_buffer_t& buffer) {
  const auto add_bytes = [&key](const void* data, size_t bytes) {
    key.append(static_cast<const char*>(data), bytes);
  };
  add_bytes(&buffer.type, sizeof buffer.type);
  for (int d = 0; d < buffer.dimensions; d++) {
    const halide_dimension_t& dim = buffer.dim[d];
    for (const int32_t number : {dim.min, dim.extent, dim.stride})
      add_bytes(&number, sizeof number);
  }
}

// A request to our cache.
struct Request {
  std::string key;
  std::vector<void*> blocks;
  std::vector<int64_t> bytes;

  Request(const uint8_t* cache_key, int32_t size, const halide_buffer_t* computed, int32_t count,
          halide_buffer_t** buffers)
      : key(reinterpret_cast<const char*>(cache_key), static_cast<size_t>(size)) {
    if (computed) add(key, *computed);
    for (int32_t i = 0; i < count; i++) {
      add(key, *buffers[i]);
      blocks.push_back(buffers[i]->host ? buffers[i]->begin() : nullptr);
      bytes.push_back(static_cast<int64_t>(buffers[i]->size_in_bytes()));
    }
  }
  const uint8_t* key_data() const { return reinterpret_cast<const uint8_t*>(key.data()); }
  auto key_bytes() const { return static_cast<int32_t>(key.size()); }
  auto count() const { return static_cast<int32_t>(blocks.size()); }
};

// Allocates memory for all buffers, or for none.
bool allocate(void* user_context, Request& request, halide_buffer_t** buffers) {
  for (int32_t i = 0; i < request.count(); i++) {
    void* block = halide_malloc(user_context, static_cast<size_t>(request.bytes[i]));
    if (!block) {
      while (i-- > 0) {
        halide_memoization_cache_release(user_context, request.blocks[i]);
        buffers[i]->host = nullptr;
      }
      return false;
    }
    request.blocks[i] = block;
    buffers[i]->host = static_cast<uint8_t*>(block);
  }
  return true;
}

}  // namespace

RETROGRADE_WEAK int halide_memoization_cache_lookup(void* user_context, const uint8_t* cache_key,
                                                    int32_t size, halide_buffer_t* realized_bounds,
                                                    int32_t tuple_count,
                                                    halide_buffer_t** tuple_buffers) {
  try {
    Request request(cache_key, size, realized_bounds, tuple_count, tuple_buffers);
    if (!allocate(user_context, request, tuple_buffers)) return -1;
    return retrograde_memoization_lookup(nullptr, request.key_data(), request.key_bytes(),
                                         request.count(), request.blocks.data(),
                                         request.bytes.data());
  } catch (const std::bad_alloc&) {
    return -1;
  }
}

RETROGRADE_WEAK int halide_memoization_cache_store(void*, const uint8_t* cache_key, int32_t size,
                                                   halide_buffer_t* realized_bounds,
                                                   int32_t tuple_count,
                                                   halide_buffer_t** tuple_buffers,
                                                   bool has_eviction_key, uint64_t eviction_key) {
  try {
    const Request request(cache_key, size, realized_bounds, tuple_count, tuple_buffers);
    return retrograde_memoization_store(nullptr, request.key_data(), request.key_bytes(),
                                        request.count(), request.blocks.data(),
                                        request.bytes.data(), has_eviction_key, eviction_key);
  } catch (const std::bad_alloc&) {  // not cached; recomputed next time
    return 0;
  }
}

RETROGRADE_WEAK void halide_memoization_cache_release(void* user_context, void* host) {
  halide_free(user_context, host);
}

RETROGRADE_WEAK void halide_memoization_cache_set_size(int64_t size) {
  retrograde_memoization_set_size(size);
}
RETROGRADE_WEAK void halide_memoization_cache_evict(void*, uint64_t eviction_key) {
  retrograde_memoization_evict(eviction_key);
}
RETROGRADE_WEAK void halide_memoization_cache_cleanup() { retrograde_memoization_cleanup(); }
