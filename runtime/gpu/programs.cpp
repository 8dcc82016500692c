// Loads programs of kernels.
#include "gpu/programs.h"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace retrograde::runtime {
namespace {

uint64_t hash(std::string_view text, uint64_t seed) {
  for (const char c : text) seed = (seed ^ static_cast<uint8_t>(c)) * 0x100000001b3u;  // FNV-1a
  return seed;
}

}  // namespace

Program::Program(const void* source, int64_t bytes)
    : source_(source), bytes_(bytes), fingerprint_(fingerprint()) {}

const retrograde_gpu_image* Program::image() const {
  uint64_t magic = 0;
  if (bytes_ < static_cast<int64_t>(sizeof(retrograde_gpu_image))) return nullptr;
  std::memcpy(&magic, source_, sizeof magic);
  return magic == RETROGRADE_GPU_IMAGE_MAGIC ? static_cast<const retrograde_gpu_image*>(source_)
                                             : nullptr;
}

// Hashes the PTX, and the addresses of the kernels for the simulated device.
uint64_t Program::fingerprint() const {
  constexpr uint64_t seed = 0xcbf29ce484222325u;
  const retrograde_gpu_image* given = image();
  if (!given) return hash({static_cast<const char*>(source_), static_cast<size_t>(bytes_)}, seed);
  uint64_t result = given->ptx ? hash({given->ptx, given->ptx_bytes}, seed) : seed;
  for (int32_t i = 0; i < given->num_kernels; i++) {
    const auto place = reinterpret_cast<uintptr_t>(given->kernels[i].simt);
    result = (hash(given->kernels[i].name, result) ^ place) * 0x100000001b3u;
  }
  return result;
}

const retrograde_gpu_kernel* Program::description(const char* name) const {
  const retrograde_gpu_image* given = image();
  for (int32_t i = 0; given && i < given->num_kernels; i++) {
    if (std::strcmp(given->kernels[i].name, name) == 0) return &given->kernels[i];
  }
  return nullptr;
}

LoadedProgram* Program::on(const DeviceState& device) {
  for (LoadedProgram& loaded : loaded_) {
    if (loaded.device == &device) return &loaded;
  }
  return nullptr;
}

// Whether the image has all its kernels for the simulated device.
bool Program::is_simulated() const {
  const retrograde_gpu_image* given = image();
  for (int32_t i = 0; given && i < given->num_kernels; i++) {
    if (!given->kernels[i].simt) return false;
  }
  return true;
}

int32_t Program::load_module(const Session& session, Module& module) const {
  const retrograde_gpu_image* given = image();
  if (session.driver().is_simulated && !is_simulated())
    return session.request.refuse(
        "the simulated device runs kernels that were compiled for it",
        "these were compiled for devices alone",
        "Compile them again with RETROGRADE_GPU=simulated in the environment of the compiler");
  if (given && !given->ptx && !session.driver().is_simulated)
    return session.request.refuse("kernels for a device must have been compiled to PTX",
                                  "these were compiled for the simulated device alone",
                                  "Set RETROGRADE_GPU=simulated, or compile them for a device");
  const char* ptx = given ? given->ptx : static_cast<const char*>(source_);
  const uint64_t ptx_bytes = given ? given->ptx_bytes : static_cast<uint64_t>(bytes_);
  if (ptx && load_assembled(session, ptx, ptx_bytes, module)) return 0;
  char log[1024] = "";
  int options[] = {jit_error_log, jit_error_log_bytes};
  void* values[] = {log, reinterpret_cast<void*>(sizeof log - 1)};
  const void* code = given && !session.driver().is_simulated ? given->ptx : source_;
  const Result result = session.driver().cuModuleLoadDataEx(&module, code, 2, options, values);
  return result == success ? 0 : session.failed("cuModuleLoadDataEx", result, log);
}

int32_t Program::load(const Session& session) {
  const std::lock_guard lock(mutex_);
  if (on(session.device())) return 0;
  uint64_t capture = 0;
  if (const int32_t code = session.capture(capture)) return code;
  if (capture != 0)
    return session.request.refuse("nothing is loaded while a graph is captured",
                                  "these kernels have not run on this device yet",
                                  "Run the pipeline once before the capture");
  loaded_.emplace_back();
  loaded_.back().device = &session.device();
  const int32_t code = load_module(session, loaded_.back().module);
  if (code != 0) loaded_.pop_back();
  return code;
}

int32_t Program::find(const Session& session, const char* name, int32_t shared_bytes,
                      Function& function) {
  const std::lock_guard lock(mutex_);
  LoadedProgram* program = on(session.device());
  if (!program)
    return session.request.refuse("kernels are loaded on the device that runs them",
                                  "these are not loaded on this one",
                                  "Initialize them with the device of this call");
  auto found = program->kernels.find(std::string_view(name));
  if (found == program->kernels.end()) {
    LoadedKernel kernel;
    const Result result =
        session.driver().cuModuleGetFunction(&kernel.function, program->module, name);
    if (result != success) return session.failed("cuModuleGetFunction", result);
    found = program->kernels.emplace(name, kernel).first;
  }
  function = found->second.function;
  return allow_shared(session, found->second, shared_bytes);
}

// A kernel may use only little shared memory unless the driver is told otherwise; this does so once per limit.
int32_t Program::allow_shared(const Session& session, LoadedKernel& kernel, int32_t bytes) const {
  constexpr int always_allowed = 48 << 10;
  if (bytes <= always_allowed || bytes <= kernel.shared_bytes) return 0;
  const Result result =
      session.driver().cuFuncSetAttribute(kernel.function, function_max_shared_bytes, bytes);
  if (result == success) {
    kernel.shared_bytes = bytes;
    return 0;
  }
  const Line asked("for %i bytes of shared memory", int64_t{bytes});
  int most = 0;
  if (session.driver().cuDeviceGetAttribute(&most, attribute_shared_bytes_opt_in,
                                            session.device().number) != success)
    return session.failed("cuFuncSetAttribute", result, asked);
  if (bytes <= most) return session.failed("cuFuncSetAttribute", result, asked);
  return session.request.refuse(
      retrograde_error_out_of_memory,
      "a block uses no more shared memory than the device has for one",
      Line("it needs %i bytes, and there are %i", int64_t{bytes}, int64_t{most}),
      "Compute less at a time of what is stored there, or store it in MemoryType::Heap");
}

LoadedProgram Program::take(const DeviceState* device) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(loaded_.begin(), loaded_.end(), [&](const LoadedProgram& loaded) {
    return !device || loaded.device == device;
  });
  if (found == loaded_.end()) return {};
  LoadedProgram taken = std::move(*found);
  loaded_.erase(found);
  return taken;
}

void Program::put_back(LoadedProgram loaded) {
  const std::lock_guard lock(mutex_);
  loaded_.push_back(std::move(loaded));
}

std::shared_ptr<Program> find_program(const void* source) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const auto found = known.programs.find(source);
  return found == known.programs.end() ? nullptr : found->second;
}

std::shared_ptr<Program> make_program(const void* source, int64_t bytes) {
  auto made = std::make_shared<Program>(source, bytes);
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  return known.programs.emplace(source, std::move(made)).first->second;
}

std::shared_ptr<Program> forget_program(const void* source) {
  Devices& known = devices();
  const std::lock_guard lock(known.mutex);
  const auto found = known.programs.find(source);
  if (found == known.programs.end()) return nullptr;
  std::shared_ptr<Program> forgotten = std::move(found->second);
  known.programs.erase(found);
  return forgotten;
}

}  // namespace retrograde::runtime
