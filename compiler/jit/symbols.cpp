#include "jit/symbols.h"

#include <dlfcn.h>

#include <cmath>
#include <cstring>
#include <map>

#include "codegen/math/sleef_library.h"
#include "gpu/gpu_calls.h"
#include "gpu/kernel_storage.h"
#include "inquiries.h"
#include "retrograde_runtime.h"

namespace retrograde::jit {
namespace {

template <typename F>
void* pointer(F* function) {
  return reinterpret_cast<void*>(function);
}

using Table = std::map<std::string, void*>;

void add_runtime(Table& table) {
  table["retrograde_parallel_for"] = pointer(retrograde_parallel_for);
  table["retrograde_allocate"] = pointer(retrograde_allocate);
  table["retrograde_allocation_error"] = pointer(retrograde_allocation_error);
  table["retrograde_free"] = pointer(retrograde_free);
  table["retrograde_free_all"] = pointer(retrograde_free_all);
  table["retrograde_report_error"] = pointer(retrograde_report_error);
  table["retrograde_print"] = pointer(retrograde_print);
  table["retrograde_user_context"] = pointer(retrograde_user_context);
  table["retrograde_lock_element"] = pointer(retrograde_lock_element);
  table["retrograde_unlock_element"] = pointer(retrograde_unlock_element);
  table["retrograde_profiler_begin"] = pointer(retrograde_profiler_begin);
  table["retrograde_profiler_thread"] = pointer(retrograde_profiler_thread);
  table["retrograde_profiler_leave"] = pointer(retrograde_profiler_leave);
  table["retrograde_profiler_memory"] = pointer(retrograde_profiler_memory);
  table["retrograde_profiler_end"] = pointer(retrograde_profiler_end);
  table["retrograde_debug_to_file"] = pointer(retrograde_debug_to_file);
  table["retrograde_check_shape"] = pointer(retrograde_check_shape);
  table["retrograde_check_region"] = pointer(retrograde_check_region);
  table["retrograde_answer_query"] = pointer(retrograde_answer_query);
  table["retrograde_trace"] = pointer(retrograde_trace);
  table["retrograde_trace_region"] = pointer(retrograde_trace_region);
  table["retrograde_trace_type"] = pointer(retrograde_trace_type);
  table["retrograde_memoization_lookup"] = pointer(retrograde_memoization_lookup);
  table["retrograde_memoization_store"] = pointer(retrograde_memoization_store);
  table["retrograde_fork"] = pointer(retrograde_fork);
  table["retrograde_semaphore_init"] = pointer(retrograde_semaphore_init);
  table["retrograde_semaphore_acquire"] = pointer(retrograde_semaphore_acquire);
  table["retrograde_semaphore_release"] = pointer(retrograde_semaphore_release);
}

void add_gpu(Table& table) {
  table["retrograde_gpu_interface"] = pointer(retrograde_gpu_interface);
  table["retrograde_gpu_initialize_kernels"] = pointer(retrograde_gpu_initialize_kernels);
  table["retrograde_gpu_run"] = pointer(retrograde_gpu_run);
  table["retrograde_gpu_finalize_kernels"] = pointer(retrograde_gpu_finalize_kernels);
  table["retrograde_gpu_malloc"] = pointer(retrograde_gpu_malloc);
  table["retrograde_gpu_free"] = pointer(retrograde_gpu_free);
  table["retrograde_gpu_copy_to_device"] = pointer(retrograde_gpu_copy_to_device);
  table["retrograde_gpu_copy_to_host"] = pointer(retrograde_gpu_copy_to_host);
  table["retrograde_gpu_sync"] = pointer(retrograde_gpu_sync);
  table["retrograde_gpu_buffer_copy"] = pointer(retrograde_gpu_buffer_copy);
  table["retrograde_device_buffer"] = pointer(retrograde_device_buffer);
  table["retrograde_device_buffer_free"] = pointer(retrograde_device_buffer_free);
  table["retrograde_overwrite_begin"] = pointer(retrograde_overwrite_begin);
  table["retrograde_overwrite_end"] = pointer(retrograde_overwrite_end);
  table["retrograde_to_device"] = pointer(retrograde_to_device);
  table["retrograde_device_changed"] = pointer(retrograde_device_changed);
  table["retrograde_to_host"] = pointer(retrograde_to_host);
  table["retrograde_host_changed"] = pointer(retrograde_host_changed);
}

void add_libc(Table& table) {
  table["memcpy"] = pointer<void*(void*, const void*, size_t)>(std::memcpy);
  table["memmove"] = pointer<void*(void*, const void*, size_t)>(std::memmove);
  table["memset"] = pointer<void*(void*, int, size_t)>(std::memset);
}

void add_libm(Table& table) {
#define RETROGRADE_UNARY(name)                    \
  table[#name] = pointer<double(double)>(::name); \
  table[#name "f"] = pointer<float(float)>(::name##f);
#define RETROGRADE_BINARY(name)                           \
  table[#name] = pointer<double(double, double)>(::name); \
  table[#name "f"] = pointer<float(float, float)>(::name##f);
  RETROGRADE_UNARY(acos)
  RETROGRADE_UNARY(acosh)
  RETROGRADE_UNARY(asin)
  RETROGRADE_UNARY(asinh)
  RETROGRADE_UNARY(atan)
  RETROGRADE_UNARY(atanh)
  RETROGRADE_UNARY(cbrt)
  RETROGRADE_UNARY(ceil)
  RETROGRADE_UNARY(cos)
  RETROGRADE_UNARY(cosh)
  RETROGRADE_UNARY(erf) RETROGRADE_UNARY(erfc) RETROGRADE_UNARY(exp) RETROGRADE_UNARY(exp2)
      RETROGRADE_UNARY(expm1) RETROGRADE_UNARY(fabs) RETROGRADE_UNARY(floor) RETROGRADE_UNARY(
          lgamma) RETROGRADE_UNARY(log) RETROGRADE_UNARY(log10) RETROGRADE_UNARY(log1p)
          RETROGRADE_UNARY(log2) RETROGRADE_UNARY(nearbyint) RETROGRADE_UNARY(rint)
              RETROGRADE_UNARY(round) RETROGRADE_UNARY(roundeven) RETROGRADE_UNARY(sin)
                  RETROGRADE_UNARY(sinh) RETROGRADE_UNARY(sqrt) RETROGRADE_UNARY(tan)
                      RETROGRADE_UNARY(tanh) RETROGRADE_UNARY(tgamma) RETROGRADE_UNARY(trunc)
                          RETROGRADE_BINARY(atan2) RETROGRADE_BINARY(copysign)
                              RETROGRADE_BINARY(fdim) RETROGRADE_BINARY(fmax)
                                  RETROGRADE_BINARY(fmin) RETROGRADE_BINARY(fmod)
                                      RETROGRADE_BINARY(hypot) RETROGRADE_BINARY(nextafter)
                                          RETROGRADE_BINARY(pow) RETROGRADE_BINARY(remainder)
#undef RETROGRADE_UNARY
#undef RETROGRADE_BINARY
                                              table["fma"] =
                                                  pointer<double(double, double, double)>(::fma);
  table["fmaf"] = pointer<float(float, float, float)>(::fmaf);
}

Table make_table() {
  Table table;
  add_runtime(table);
  add_gpu(table);
  add_libc(table);
  add_libm(table);
  return table;
}

}  // namespace

void* find_symbol(const std::string& name) {
  static const Table table = make_table();
  const auto found = table.find(name);
  if (found != table.end()) return found->second;
  if (name.rfind("Sleef_", 0) == 0) return codegen::find_in_sleef(name.c_str());
  return dlsym(RTLD_DEFAULT, name.c_str());
}

}  // namespace retrograde::jit
