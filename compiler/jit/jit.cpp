// Compiles, links and caches lowered functions.
#include "jit/jit.h"

#include <chrono>
#include <list>
#include <mutex>
#include <unordered_map>

#include "codegen/codegen.h"
#include "codegen/device/kernel_code.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "diagnostics/pass_observer.h"
#include "gpu/gpu_calls.h"
#include "gpu/gpu_image.h"
#include "ir/visit.h"
#include "jit/disk_cache.h"
#include "jit/fingerprint.h"
#include "jit/kernel_images.h"
#include "jit/linker.h"
#include "retrograde_runtime.h"

namespace retrograde::jit {
namespace {

// The names of its launches, in the order of its kernels.
std::vector<std::string> launches_of(const ir::LoweredFunction& function) {
  std::vector<std::string> names;
  ir::walk(function.body, [&](const ir::Launch& n) { names.push_back(n.name); });
  return names;
}

std::vector<std::string> notes_of(const retrograde_gpu_image& image,
                                  const std::vector<std::string>& launches) {
  std::vector<std::string> notes;
  const auto local = codegen::local_bytes_by_kernel({image.ptx, image.ptx_bytes});
  for (int32_t i = 0; i < image.num_kernels; ++i) {
    const int64_t bytes = ir::value_or(local, image.kernels[i].name, int64_t{0});
    const auto at = static_cast<size_t>(i);
    if (bytes > 0 && at < launches.size())
      notes.push_back(codegen::local_memory_note(launches[at], bytes));
  }
  return notes;
}

class Compiled : public CompiledFunction {
 public:
  Compiled(const ir::LoweredFunction& function, const codegen::Options& options,
           const Externs& externs) {
    const CachedObject code = load_or_generate(function, options);
    const auto start = std::chrono::steady_clock::now();
    object_ = link(code.object, code.function, externs);
    address_ = object_->find(code.function);
    argv_ = reinterpret_cast<Argv*>(object_->find(code.function + "_argv"));
    if (const std::vector<std::string> launches = launches_of(function); !launches.empty()) {
      offer_kernel_images();
      kernels_ = object_->find(code.function + ".kernels.image");
      notes_ = notes_of(*static_cast<const retrograde_gpu_image*>(kernels_), launches);
    }
    times_.link_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    tell_pass_observers({function.name, "link", times_.link_seconds, {}});
  }
  // Devices drop what they have loaded of the function before its code is unmapped.
  ~Compiled() override {
    if (kernels_) retrograde_gpu_forget_kernels(kernels_);
  }
  int call(retrograde_context* context, void** args) const override { return argv_(context, args); }
  void* address() const override { return address_; }
  const CompileTimes& times() const override { return times_; }
  const std::vector<std::string>& notes() const override { return notes_; }

 private:
  using Argv = int32_t(retrograde_context*, void**);

  CachedObject load_or_generate(const ir::LoweredFunction& function,
                                const codegen::Options& options) {
    const std::shared_ptr<DiskCache> disk = disk_cache();
    if (!disk) return generate(function, options);
    const std::string key = disk_cache_key(function, options);
    if (std::optional<CachedObject> found = disk->find(key)) return std::move(*found);
    CachedObject code = generate(function, options);
    disk->insert(key, code);
    return code;
  }

  CachedObject generate(const ir::LoweredFunction& function, const codegen::Options& options) {
    codegen::Module module = codegen::compile_object(function, options);
    times_ = {module.times.generate_seconds, module.times.optimize_seconds,
              module.times.emit_seconds, 0};
    tell_pass_observers({function.name, "llvm_generate", times_.generate_seconds, {}});
    tell_pass_observers({function.name, "llvm_optimize", times_.optimize_seconds, {}});
    tell_pass_observers({function.name, "llvm_emit", times_.emit_seconds, {}});
    return {function.name, std::move(module.object)};
  }

  std::unique_ptr<LinkedObject> object_;
  void* address_ = nullptr;
  Argv* argv_ = nullptr;
  void* kernels_ = nullptr;
  CompileTimes times_;
  std::vector<std::string> notes_;
};

using Handle = std::shared_ptr<const CompiledFunction>;

struct KeyHash {
  size_t operator()(const Fingerprint& key) const { return key.low; }
};

// A least-recently-used cache; the most recent function is first.
class Cache {
 public:
  Handle find(const Fingerprint& key) {
    const std::lock_guard lock(mutex_);
    const auto found = index_.find(key);
    if (found == index_.end()) {
      misses_++;
      return nullptr;
    }
    hits_++;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->second;
  }

  // Returns the function that the cache keeps: another thread may have compiled it first.
  Handle insert(const Fingerprint& key, Handle function) {
    const std::lock_guard lock(mutex_);
    if (const auto* found = ir::find_or_null(index_, key)) return (*found)->second;
    entries_.emplace_front(key, function);
    index_[key] = entries_.begin();
    if (entries_.size() > cache_capacity) {
      index_.erase(entries_.back().first);
      entries_.pop_back();
    }
    return function;
  }

  CacheStatistics statistics() {
    const std::lock_guard lock(mutex_);
    return {entries_.size(), hits_, misses_};
  }

  void clear() {
    const std::lock_guard lock(mutex_);
    entries_.clear();
    index_.clear();
  }

 private:
  using Entries = std::list<std::pair<Fingerprint, Handle>>;
  std::mutex mutex_;
  Entries entries_;
  std::unordered_map<Fingerprint, Entries::iterator, KeyHash> index_;
  size_t hits_ = 0, misses_ = 0;
};

Cache& cache() {
  static Cache& instance = *new Cache;  // never destroyed: code may run while the process exits
  return instance;
}

void check_runs_here(const Target& target) {
  const Target host = get_host_target();
  if (target.arch == host.arch && target.bits == host.bits && target.os == host.os) return;
  unsupported("run code for target \"" + target.to_string() + "\"",
              "the JIT runs code on this machine", "which is \"" + host.to_string() + "\"",
              "Compile for \"host\"");
}

Fingerprint key_of(const ir::LoweredFunction& function, const codegen::Options& options,
                   const Externs& externs) {
  Fingerprint key;
  run_on_large_stack([&] { key = fingerprint(function); });
  key.add(options.target.to_string());
  key.add(static_cast<uint64_t>(options.optimization_level));
  key.add(static_cast<uint64_t>(options.kernels_for_executor));
  for (const auto& [name, address] : externs) {
    key.add(name);
    key.add(reinterpret_cast<uint64_t>(address));
  }
  return key;
}

// Where one call reports its error and its prints.
struct CallState {
  std::string error;
  const CallOptions& options;
  std::mutex mutex;
};

CallState& state_of(retrograde_context* context) {
  return *static_cast<CallState*>(context->user_data);
}

void keep_error(retrograde_context* context, int, const char* message) {
  state_of(context).error = message;
}

void pass_print(retrograde_context* context, const char* message) {
  CallState& state = state_of(context);
  const std::lock_guard lock(state.mutex);
  state.options.on_print(message);
}

}  // namespace

void CompiledFunction::run(void** args, const CallOptions& options) const {
  CallState state{{}, options, {}};
  retrograde_context context = {};
  context.error_handler = keep_error;
  context.print_handler = options.on_print ? pass_print : nullptr;
  context.thread_limit = options.thread_limit;
  context.user_data = &state;
  const int code = call(&context, args);
  if (code == 0) return;
  throw RuntimeError(state.error.empty() ? std::string(retrograde_error_name(code)) : state.error,
                     code);
}

Handle compile(const ir::LoweredFunction& function, const Target& target, const Options& options) {
  check_runs_here(target);
  codegen::Options code_options;
  code_options.target = target;
  code_options.optimization_level = options.optimization_level;
  code_options.parts = options.parts;
  if (!options.use_cache)
    return std::make_shared<Compiled>(function, code_options, options.externs);
  const Fingerprint key = key_of(function, code_options, options.externs);
  if (Handle found = cache().find(key)) return found;
  return cache().insert(key, std::make_shared<Compiled>(function, code_options, options.externs));
}

CacheStatistics cache_statistics() { return cache().statistics(); }
void clear_cache() { cache().clear(); }

}  // namespace retrograde::jit
