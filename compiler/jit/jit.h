// Compiles lowered functions in this process and calls them.
//
// Everything here may be called from several threads at once. Pages of machine code are first writable and then
// executable, never both. They are unmapped with the last handle to the function.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ir/lowered_function.h"
#include "ir/target.h"

struct retrograde_context;

namespace retrograde::jit {

struct CompileTimes {
  double generate_seconds = 0;  // our IR to LLVM's
  double optimize_seconds = 0;
  double emit_seconds = 0;  // LLVM's IR to bytes
  double link_seconds = 0;
  double total() const { return generate_seconds + optimize_seconds + emit_seconds + link_seconds; }
};

struct CallOptions {
  int thread_limit = 0;  // 0: no limit
  std::function<void(const std::string&)>
      on_print;  // a line of print(), from any thread; if empty, prints are discarded
};

class CompiledFunction {
 public:
  virtual ~CompiledFunction() = default;
  // args[i]: the halide_buffer_t *, or a pointer to the scalar. Returns the error code; errors go to the context's
  // handler.
  virtual int call(retrograde_context* context, void** args) const = 0;
  // The same, but throws an error as RuntimeError with the code and message of generated code.
  void run(void** args, const CallOptions& options = {}) const;
  // int32 name(retrograde_context *, args...); valid as long as this object lives.
  virtual void* address() const = 0;
  // Times of the original compilation; later cache hits cost none of it.
  virtual const CompileTimes& times() const = 0;
  // Performance notes about its kernels.
  virtual const std::vector<std::string>& notes() const = 0;
};

struct Options {
  bool use_cache = true;
  int optimization_level = 1;
  unsigned parts = 0;  // number of parts to compile in parallel; 0: chosen by size and machine
  // C functions that the code may call by name; they take precedence over those of the runtime and the process.
  std::map<std::string, void*> externs = {};
};

// Throws UserError if the function calls a C function that the process does not have, and Unsupported if this machine
// cannot run code for the target.
std::shared_ptr<const CompiledFunction> compile(const ir::LoweredFunction& function,
                                                const Target& target, const Options& options = {});

// The cache of compile(). Its key is what the function computes, not its names. It keeps at most `cache_capacity`
// functions and evicts the least recently used one.
inline constexpr size_t cache_capacity = 256;
struct CacheStatistics {
  size_t size = 0, hits = 0, misses = 0;
};
CacheStatistics cache_statistics();
void clear_cache();

}  // namespace retrograde::jit
