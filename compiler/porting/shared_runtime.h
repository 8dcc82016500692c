// shared_runtime.h -- settings of the runtime that compiled code of this process calls.
#pragma once

#include <cstdint>

#include "frontend/run/jit_handlers.h"

namespace retrograde::porting {

struct JITSharedRuntime {
  // Handlers of all calls: those of a Pipeline or of a call's context go before them. The ones
  // before come back.
  static JITHandlers set_default_handlers(const JITHandlers& handlers);
  // Makes the context's handlers those of a call with `handlers`, and its custom_malloc and custom_free
  // functions that handlers can call in theirs, where nothing else is set.
  // Requires: there is a context.
  static void populate_jit_handlers(JITUserContext* context, const JITHandlers& handlers);
  // Bytes that results of memoized Funcs may hold; 0: the default.
  static void memoization_cache_set_size(int64_t bytes);
  static void memoization_cache_evict(uint64_t eviction_key);
  // Whether device memory that is freed is kept for later allocations.
  static void reuse_device_allocations(bool reuse);
  // Threads of parallel loops; 0: as many as there are. The number before comes back.
  static int set_num_threads(int threads);
  static int get_num_threads();
  // Gives back unused memory of host and devices, memoized results and kernels.
  static void release_all();
};

}  // namespace retrograde::porting
