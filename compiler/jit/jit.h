// Lowered functions compiled in this process and called.
//
// Everything here may be called from several threads at once. Machine code lives in pages that are
// written first and then made executable, never both, and is unmapped with the last handle to it.
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
  int thread_limit = 0;  // 0: all
  std::function<void(const std::string&)>
      on_print;  // a line of print(), from any thread; none: thrown away
};

class CompiledFunction {
 public:
  virtual ~CompiledFunction() = default;
  // args[i]: the halide_buffer_t *, or a pointer to the scalar. Gives the error code; errors go to
  // the context's handler.
  virtual int call(retrograde_context* context, void** args) const = 0;
  // The same; an error is thrown as RuntimeError with its code and the message of generated code.
  void run(void** args, const CallOptions& options = {}) const;
  // int32 name(retrograde_context *, args...), as long as this object lives.
  virtual void* address() const = 0;
  // What compiling it took; a later hit in the cache costs nothing of it.
  virtual const CompileTimes& times() const = 0;
  // What is slower in it than it need be: performance notes, of its kernels.
  virtual const std::vector<std::string>& notes() const = 0;
};

struct Options {
  bool use_cache = true;
  int optimization_level = 1;
  unsigned parts = 0;  // that are compiled at the same time; 0: what suits size and machine
  // C functions that the code calls by name, before those of the runtime and the process.
  std::map<std::string, void*> externs = {};
};

// UserError when the function calls a C function that is nowhere in the process;
// Unsupported when the machine cannot run code for the target.
std::shared_ptr<const CompiledFunction> compile(const ir::LoweredFunction& function,
                                                const Target& target, const Options& options = {});

// The cache of compile(): by what the function computes, not by its names. At most `cache_capacity`
// functions, the least recently used go first.
inline constexpr size_t cache_capacity = 256;
struct CacheStatistics {
  size_t size = 0, hits = 0, misses = 0;
};
CacheStatistics cache_statistics();
void clear_cache();

}  // namespace retrograde::jit
