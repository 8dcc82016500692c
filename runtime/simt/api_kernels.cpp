// The simulated driver's functions for modules, functions and launches.
#include <cstring>

#include "simt/call.h"
#include "simt/launch.h"

namespace retrograde::simt {
namespace {

using Function_ = ModuleState::FunctionState;

constexpr int shared_by_default = 48 << 10, shared_at_most = 227 << 10;

// Writes to the caller's buffer for errors of the driver's compiler.
void write_log(unsigned count, const int* options, void* const* values, const char* text) {
  char* log = nullptr;
  size_t bytes = 0;
  for (unsigned i = 0; i < count; i++) {
    if (options[i] == jit_error_log) log = static_cast<char*>(values[i]);
    if (options[i] == jit_error_log_bytes) bytes = reinterpret_cast<size_t>(values[i]);
  }
  if (!log || bytes == 0) return;
  std::strncpy(log, text, bytes - 1);
  log[bytes - 1] = 0;
}

const char* what_is_wrong(const void* code) {
  uint64_t magic = 0;
  std::memcpy(&magic, code, sizeof magic);
  if (magic != RETROGRADE_GPU_IMAGE_MAGIC)
    return "the simulated device runs kernels that were compiled for it, and this is none of its "
           "images";
  const auto* image = static_cast<const retrograde_gpu_image*>(code);
  for (int32_t i = 0; i < image->num_kernels; i++) {
    if (!image->kernels[i].simt) return "a kernel was compiled for devices alone";
  }
  return nullptr;
}

Function_* find_function(ContextState& context, Function handle) {
  for (const auto& module : context.modules) {
    for (const auto& [name, function] : module->functions) {
      if (function.get() == handle) return function.get();
    }
  }
  return nullptr;
}

// Packs the arguments in order, each at its natural alignment.
std::vector<uint64_t> pack(const retrograde_gpu_kernel& kernel, void** args) {
  std::vector<uint64_t> packed;
  size_t end = 0;
  for (int32_t i = 0; i < kernel.num_args; i++) {
    const auto bytes = static_cast<size_t>(kernel.arg_bytes[i]);
    const size_t begin = (end + bytes - 1) / bytes * bytes;
    end = begin + bytes;
    packed.resize((end + 7) / 8);
    std::memcpy(reinterpret_cast<uint8_t*>(packed.data()) + begin, args[i], bytes);
  }
  return packed;
}

Result check(const Launch& launch, int shared_limit) {
  constexpr int32_t most_threads[] = {1024, 1024, 64};
  constexpr int32_t most_blocks[] = {0x7fffffff, 65535, 65535};
  for (int d = 0; d < 3; d++) {
    if (launch.threads[d] < 1 || launch.threads[d] > most_threads[d]) return invalid_value;
    if (launch.blocks[d] < 1 || launch.blocks[d] > most_blocks[d]) return invalid_value;
  }
  if (int64_t{launch.threads[0]} * launch.threads[1] * launch.threads[2] > 1024)
    return invalid_value;
  return launch.shared_bytes < 0 || launch.shared_bytes > shared_limit ? invalid_value : success;
}

Result run_unless_told(const Launch& launch) {
  const Result verdict = begin_call("kernel");
  if (verdict == success) return run(launch);
  set_finding(std::string("kernel ") + launch.kernel->name + ": told to fail");
  return verdict;
}

}  // namespace
}  // namespace retrograde::simt

using namespace retrograde::simt;

RETROGRADE_SIMT_EXPORT Result cuModuleLoadDataEx(Module* module, const void* code, unsigned count,
                                                 int* options, void** values) {
  return call_in_context("cuModuleLoadDataEx", [&](ContextState& context) -> Result {
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    if (const char* wrong = what_is_wrong(code)) {
      write_log(count, options, values, wrong);
      return invalid_image;
    }
    auto made = std::make_unique<ModuleState>();
    made->image = static_cast<const retrograde_gpu_image*>(code);
    *module = made.get();
    context.modules.insert(std::move(made));
    return success;
  });
}

// Waits for the module's kernels.
RETROGRADE_SIMT_EXPORT Result cuModuleUnload(Module module) {
  return call_in_context("cuModuleUnload", [&](ContextState& context) -> Result {
    if (const Result refused = refuse_in_capture(); refused != success) return refused;
    if (const Result result = complete_all(context); result != success) return result;
    return erase_from(context.modules, module) ? success : invalid_handle;
  });
}

RETROGRADE_SIMT_EXPORT Result cuModuleGetFunction(Function* function, Module handle,
                                                  const char* name) {
  return call_in_context("cuModuleGetFunction", [&](ContextState& context) -> Result {
    ModuleState* module = find_in(context.modules, handle);
    if (!module) return invalid_handle;
    for (int32_t i = 0; i < module->image->num_kernels; i++) {
      const retrograde_gpu_kernel& kernel = module->image->kernels[i];
      if (std::strcmp(kernel.name, name) != 0) continue;
      auto& made = module->functions[name];
      if (!made) made = std::make_unique<Function_>(Function_{&kernel, shared_by_default});
      *function = made.get();
      return success;
    }
    return not_found;
  });
}

RETROGRADE_SIMT_EXPORT Result cuFuncGetAttribute(int* value, int attribute, Function handle) {
  return call_in_context("cuFuncGetAttribute", [&](ContextState& context) -> Result {
    const Function_* function = find_function(context, handle);
    if (!function) return invalid_handle;
    if (attribute != function_max_threads && attribute != function_max_shared_bytes)
      return invalid_value;
    *value = attribute == function_max_threads ? 1024 : function->shared_limit;
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuFuncSetAttribute(Function handle, int attribute, int value) {
  return call_in_context("cuFuncSetAttribute", [&](ContextState& context) -> Result {
    Function_* function = find_function(context, handle);
    if (!function) return invalid_handle;
    if (attribute != function_max_shared_bytes || value < 0 || value > shared_at_most)
      return invalid_value;
    function->shared_limit = std::max(value, shared_by_default);
    return success;
  });
}

RETROGRADE_SIMT_EXPORT Result cuLaunchKernel(Function handle, unsigned blocks_x, unsigned blocks_y,
                                             unsigned blocks_z, unsigned threads_x,
                                             unsigned threads_y, unsigned threads_z,
                                             unsigned shared_bytes, Stream stream_handle,
                                             void** args, void**) {
  return call_on_stream("cuLaunchKernel", stream_handle, [&](StreamState& stream) -> Result {
    const Function_* function = find_function(*stream.context, handle);
    if (!function) return invalid_handle;
    if (!stream.capture) {
      if (const Result refused = refuse_on(stream); refused != success) return refused;
    }
    const auto extent = [](unsigned n) { return static_cast<int32_t>(n); };
    Launch launch = {function->kernel,
                     {extent(blocks_x), extent(blocks_y), extent(blocks_z)},
                     {extent(threads_x), extent(threads_y), extent(threads_z)},
                     extent(shared_bytes),
                     {},
                     stream.context->device};
    if (const Result wrong = check(launch, function->shared_limit); wrong != success) return wrong;
    launch.args = pack(*function->kernel, args);
    return enqueue(stream, [launch] { return run_unless_told(launch); });
  });
}
