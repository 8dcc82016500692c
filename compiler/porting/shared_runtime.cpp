#include "porting/shared_runtime.h"

#include <algorithm>
#include <cstdlib>
#include <thread>
#include <utility>

#include "diagnostics/error.h"
#include "frontend/run/call.h"
#include "gpu/gpu_calls.h"
#include "gpu/host.h"
#include "retrograde_runtime.h"

namespace retrograde::porting {

JITHandlers JITSharedRuntime::set_default_handlers(const JITHandlers& handlers) {
  return frontend::set_default_handlers(handlers);
}

namespace {
void* allocate(JITUserContext*, size_t bytes) {
  constexpr size_t alignment = 64;
  return std::aligned_alloc(alignment,
                            (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment);
}
void release(JITUserContext*, void* memory) { std::free(memory); }
}  // namespace

void JITSharedRuntime::populate_jit_handlers(JITUserContext* context, const JITHandlers& handlers) {
  if (!context) {
    user_error("fill in the handlers of a context", "the context is not null", "it is null",
               "Give the address of a JITUserContext");
  }
  JITHandlers own;
  own.custom_malloc = allocate;
  own.custom_free = release;
  context->handlers =
      frontend::merged(frontend::merged(std::move(own), frontend::default_handlers()), handlers);
}

void JITSharedRuntime::memoization_cache_set_size(int64_t bytes) {
  retrograde_memoization_set_size(bytes);
}
void JITSharedRuntime::memoization_cache_evict(uint64_t eviction_key) {
  retrograde_memoization_evict(eviction_key);
}

void JITSharedRuntime::reuse_device_allocations(bool reuse) {
  runtime::set_reuses_device_memory(reuse);
  if (!reuse) retrograde_gpu_release_unused(nullptr);
}

int JITSharedRuntime::set_num_threads(int threads) {
  if (threads < 0) {
    user_error("set the number of threads", "it is not negative", text("it is ", threads),
               "Give 0 for as many as the machine has");
  }
  const int before = get_num_threads();
  JITHandlers handlers = frontend::default_handlers();
  handlers.thread_limit = threads;
  frontend::set_default_handlers(handlers);
  return before;
}
int JITSharedRuntime::get_num_threads() {
  const int limit = frontend::default_handlers().thread_limit;
  return limit > 0 ? limit : static_cast<int>(std::thread::hardware_concurrency());
}

void JITSharedRuntime::release_all() {
  retrograde_gpu_release(nullptr);
  retrograde_memoization_cleanup();
  retrograde_pool_release();
}

}  // namespace retrograde::porting
