// Loads, launches and unloads kernels for generated code.
#include <HalideRuntime.h>

#include <array>

#include "gpu/device_memory.h"
#include "gpu/gpu_calls.h"
#include "gpu/programs.h"

namespace retrograde::runtime {
namespace {

struct Launch {
  const char* name;
  int32_t blocks[3], threads[3];
  int32_t shared_bytes;
  const size_t* arg_sizes;
  void* const* args;
  const int8_t* arg_is_buffer;

  bool is_empty() const { return blocks[0] == 0 || blocks[1] == 0 || blocks[2] == 0; }
  size_t arg_count() const {
    size_t count = 0;
    while (arg_sizes[count] != 0) count++;
    return count;
  }
  Line text() const {
    return Line("%i x %i x %i blocks of %i x %i x %i threads with %i bytes of shared memory",
                int64_t{blocks[0]}, int64_t{blocks[1]}, int64_t{blocks[2]}, int64_t{threads[0]},
                int64_t{threads[1]}, int64_t{threads[2]}, int64_t{shared_bytes});
  }
};

int32_t check_extents(const Request& request, const Launch& launch) {
  bool is_legal = launch.shared_bytes >= 0;
  for (int d = 0; d < 3; d++) is_legal = is_legal && launch.blocks[d] >= 0 && launch.threads[d] > 0;
  return is_legal ? 0
                  : request.refuse("a launch has threads, and no negative extents", launch.text(),
                                   "Pass a region that is not negative");
}

// A launch's argument array: values, and the device addresses of buffers.
class Arguments {
 public:
  int32_t gather(const Session& session, const Launch& launch) {
    const size_t count = launch.arg_count();
    if (count > few) {
      more_addresses_.resize(count);
      more_pointers_.resize(count);
    }
    for (size_t i = 0; i < count; i++) {
      pointers()[i] = launch.args[i];
      if (!launch.arg_is_buffer[i]) continue;
      const auto* buffer = static_cast<const halide_buffer_t*>(launch.args[i]);
      if (buffer->device == 0) return not_on_device(session.request, i);
      if (const int32_t code = note_use(session, buffer->device)) return code;
      addresses()[i] = buffer->device;
      pointers()[i] = &addresses()[i];
    }
    return 0;
  }
  void** pointers() { return more_pointers_.empty() ? pointers_.data() : more_pointers_.data(); }

 private:
  static constexpr size_t few = 48;
  Address* addresses() {
    return more_addresses_.empty() ? addresses_.data() : more_addresses_.data();
  }
  static int32_t not_on_device(const Request& request, size_t i) {
    return request.refuse("a kernel's buffers must be on the device",
                          Line("argument %u has no device memory", uint64_t{i}),
                          "Copy it to the device first");
  }

  std::array<Address, few> addresses_;  // uninitialised, and enough for most calls
  std::array<void*, few> pointers_;
  std::vector<Address> more_addresses_;
  std::vector<void*> more_pointers_;
};

int32_t check_arguments(const Request& request, const Launch& launch,
                        const retrograde_gpu_kernel& kernel) {
  const size_t count = launch.arg_count();
  bool fits = count == static_cast<size_t>(kernel.num_args);
  for (size_t i = 0; fits && i < count; i++)
    fits = launch.arg_sizes[i] == static_cast<size_t>(kernel.arg_bytes[i]);
  return fits ? 0
              : request.refuse("a kernel gets the arguments that it was compiled for",
                               Line("%u were passed, it has %i, or their sizes differ",
                                    uint64_t{count}, int64_t{kernel.num_args}),
                               "Pass what the kernel's signature says");
}

int32_t start(const Session& session, const Launch& launch, Function function, void** args) {
  const auto extent = [](int32_t n) { return static_cast<unsigned>(n); };
  const Result result = session.driver().cuLaunchKernel(
      function, extent(launch.blocks[0]), extent(launch.blocks[1]), extent(launch.blocks[2]),
      extent(launch.threads[0]), extent(launch.threads[1]), extent(launch.threads[2]),
      extent(launch.shared_bytes), session.stream(), args, nullptr);
  if (result == success) return 0;
  int most = 0;
  if (session.driver().cuFuncGetAttribute(&most, function_max_threads, function) != success)
    return session.failed("cuLaunchKernel", result, launch.text());
  return session.failed("cuLaunchKernel", result,
                        Line("%s; the kernel can have %i threads in a block",
                             static_cast<const char*>(launch.text()), int64_t{most}));
}

int32_t run(const Session& session, const void* source, const Launch& launch) {
  const auto program = find_program(source);
  if (!program)
    return session.request.refuse("kernels must be loaded before they run",
                                  "these were never loaded, or unloaded since",
                                  "Initialize them first");
  Function function = nullptr;
  if (const int32_t code = program->find(session, launch.name, launch.shared_bytes, function))
    return code;
  if (const auto* kernel = program->description(launch.name)) {
    if (const int32_t code = check_arguments(session.request, launch, *kernel)) return code;
  }
  Arguments arguments;
  if (const int32_t code = arguments.gather(session, launch)) return code;
  return start(session, launch, function, arguments.pointers());
}

// ---- unloading ----

// Unloads everything loaded of a program that will not run again. Modules that the driver fails to unload are put back,
// to be tried again.
int32_t unload(const Request& request, Program& program) {
  while (true) {
    LoadedProgram loaded = program.take(nullptr);
    if (!loaded.device) return 0;
    Session session(request);
    int32_t code = session.open(loaded.device->context);
    Result result = success;
    if (code == 0) result = session.driver().cuModuleUnload(loaded.module);
    // With a lost context its kernels are lost too.
    if (loses_context(result)) result = success;
    if (result != success) code = session.failed("cuModuleUnload", result);
    const bool is_unloaded = code == 0;
    code = session.close(code);
    if (!is_unloaded) program.put_back(std::move(loaded));
    if (code != 0) return code;
  }
}

int32_t forget(const Request& request, const void* source) {
  const auto program = find_program(source);
  if (!program) return 0;
  if (const int32_t code = unload(request, *program)) return code;
  forget_program(source);
  return 0;
}

Request loading(retrograde_context* caller) {
  return {caller, retrograde_error_device_run_failed, "load kernels on a device"};
}

int32_t initialize(const Request& request, void** state, const void* source, int64_t bytes) {
  Session session(request);
  if (const int32_t code = session.open()) return session.close(code);
  auto program = find_program(source);
  // If the state is still null, the code may be new code at the address of unloaded code.
  if (program && !__atomic_load_n(state, __ATOMIC_ACQUIRE) && !program->is_of(bytes)) {
    if (const int32_t code = forget(request, source)) return session.close(code);
    program = nullptr;
  }
  if (!program) program = make_program(source, bytes);
  const int32_t code = session.close(program->load(session));
  if (code == 0) __atomic_store_n(state, const_cast<void*>(source), __ATOMIC_RELEASE);
  return code;
}

}  // namespace

int32_t unload_all(const Request& request) {
  std::vector<std::shared_ptr<Program>> programs;
  {
    Devices& known = devices();
    const std::lock_guard lock(known.mutex);
    for (const auto& [source, program] : known.programs) programs.push_back(program);
  }
  int32_t first = 0;
  for (const auto& program : programs) {
    const int32_t code = unload(request, *program);
    if (first == 0) first = code;
  }
  return first;
}

}  // namespace retrograde::runtime

namespace rt = retrograde::runtime;

int32_t retrograde_gpu_initialize_kernels(retrograde_context* caller, void** state,
                                          const void* source, int64_t bytes) {
  const rt::Request request = rt::loading(caller);
  return guarded(request, [&] { return rt::initialize(request, state, source, bytes); });
}

int32_t retrograde_gpu_run(retrograde_context* caller, void* state, const char* name,
                           int32_t blocks_x, int32_t blocks_y, int32_t blocks_z, int32_t threads_x,
                           int32_t threads_y, int32_t threads_z, int32_t shared_bytes,
                           const size_t* arg_sizes, void* const* args,
                           const int8_t* arg_is_buffer) {
  const rt::Request request(caller, retrograde_error_device_run_failed, "run the kernel \"%s\"",
                            name);
  const rt::Launch launch = {name,
                             {blocks_x, blocks_y, blocks_z},
                             {threads_x, threads_y, threads_z},
                             shared_bytes,
                             arg_sizes,
                             args,
                             arg_is_buffer};
  if (const int32_t code = rt::check_extents(request, launch)) return code;
  if (launch.is_empty()) return 0;
  return guarded(request, [&] {
    rt::Session session(request);
    int32_t code = session.open();
    if (code == 0) code = rt::run(session, state, launch);
    return session.close(code);
  });
}

void retrograde_gpu_finalize_kernels(retrograde_context*, void*) {}

void retrograde_gpu_forget_kernels(const void* source) {
  const rt::Request request = rt::loading(nullptr);
  guarded(request, [&] { return rt::forget(request, source); });
}
