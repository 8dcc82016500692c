// shared_runtime.h -- settings of the runtime that this process's compiled code calls.
#pragma once

#include <cstdint>

#include "frontend/run/jit_handlers.h"

namespace retrograde::porting {

struct JITSharedRuntime {
  // Sets the handlers of all calls; handlers of a Pipeline or of a call's context take precedence.
  // Returns the previous ones.
  static JITHandlers set_default_handlers(const JITHandlers& handlers);
  // Fills in a context for a call with `handlers`. Its custom_malloc and custom_free become
  // functions that handlers can call, unless others are set.
  // Requires: the context is not null.
  static void populate_jit_handlers(JITUserContext* context, const JITHandlers& handlers);
  // The capacity in bytes of the cache of memoized Funcs; 0: the default.
  static void memoization_cache_set_size(int64_t bytes);
  static void memoization_cache_evict(uint64_t eviction_key);
  // Whether freed device memory is kept for later allocations.
  static void reuse_device_allocations(bool reuse);
  // The number of threads of parallel loops; 0: one per core. Returns the previous number.
  static int set_num_threads(int threads);
  static int get_num_threads();
  // Releases unused host and device memory, memoized results and kernels.
  static void release_all();
};

}  // namespace retrograde::porting
