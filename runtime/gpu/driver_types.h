// Types and constants of CUDA's driver API, according to its published ABI. So building the runtime needs no CUDA
// headers.
#pragma once

#include <cstddef>
#include <cstdint>

namespace retrograde::cuda {

using Result = int;
using Device = int;
using Address = uint64_t;  // in device memory
using Context = void*;
using Module = void*;
using Function = void*;
using Stream = void*;
using Event = void*;
using Graph = void*;
using GraphExec = void*;

enum : Result {
  success = 0,
  invalid_value = 1,
  out_of_memory = 2,
  not_initialized = 3,
  no_device = 100,
  invalid_device = 101,
  invalid_image = 200,
  invalid_context = 201,
  invalid_source = 300,
  invalid_handle = 400,
  illegal_state = 401,
  not_found = 500,
  not_ready = 600,
  illegal_address = 700,
  launch_out_of_resources = 701,
  launch_failed = 719,
  capture_unsupported = 900,
  capture_invalidated = 901,
  capture_unmatched = 903,
  capture_unjoined = 904,
  capture_isolation = 905,
  capture_implicit = 906,
  unknown_error = 999
};

// Errors of asynchronous work after which the context is unusable.
inline bool loses_context(Result result) {
  return result == illegal_address || (result >= 709 && result <= 719) || result == 214;
}

enum : int {  // device attributes
  attribute_max_threads = 1,
  attribute_warp_size = 10,
  attribute_max_pitch = 11,
  attribute_multiprocessors = 16,
  attribute_major = 75,
  attribute_minor = 76,
  attribute_shared_bytes = 8,
  attribute_shared_bytes_opt_in = 97
};
enum : int { function_max_threads = 0, function_max_shared_bytes = 8 };
enum : int { pointer_context = 1, pointer_memory_type = 2 };
enum : int { jit_error_log = 5, jit_error_log_bytes = 6 };
enum : unsigned { memory_host = 1, memory_device = 2 };
enum : int { capture_mode_global = 0, capture_mode_of_thread = 1, capture_mode_relaxed = 2 };
enum : int { capture_none = 0, capture_active = 1, capture_is_invalidated = 2 };

// CUDA_MEMCPY2D
struct Copy2D {
  size_t source_x, source_y;
  unsigned source_type;
  const void* source_host;
  Address source_device;
  void* source_array;
  size_t source_pitch;
  size_t target_x, target_y;
  unsigned target_type;
  void* target_host;
  Address target_device;
  void* target_array;
  size_t target_pitch;
  size_t width_bytes, height;
};

}  // namespace retrograde::cuda
