// Compiles lowered functions to machine code or text. No type of LLVM appears in this interface.
//
// A module holds `int32 name(context, args...)` and `int32 name_argv(context, void **args)`, as retrograde_runtime.h
// describes. Compilations share no state and may run in parallel threads.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "codegen/cpu/exports.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde::codegen {

// Whether the environment variable RETROGRADE_GPU is "simulated".
bool is_gpu_simulated();

struct Options {
  Target target = get_host_target();
  // Tune for the processor of this machine, using only the target's features.
  bool tune_for_host = true;
  // 0: LLVM runs no optimization passes; 1: the passes of optimize.cpp.
  int optimization_level = 1;
  // Also compile kernels for the simulated device, which RETROGRADE_GPU=simulated selects.
  bool kernels_for_executor = is_gpu_simulated();
  // Number of parts into which a program is split, to be compiled in parallel. 0: chosen by its size; compile_object
  // uses at most one part per core.
  unsigned parts = 0;
};

struct Times {
  double generate_seconds = 0;  // our IR to LLVM's
  double optimize_seconds = 0;
  double emit_seconds = 0;  // LLVM's IR to bytes or text
};

struct Module {
  std::vector<uint8_t> object;  // a relocatable ELF file; with several parts, an archive of them
  std::vector<std::string> externals;  // symbols that it imports, sorted
  Times times;
};

// Throws InternalError if the function breaks a promise of lowering, and Unsupported for a target without a code
// generator.
Module compile_object(const ir::LoweredFunction& function, const Options& options);

// A program for ahead-of-time compilation. Functions that the exports name can only be called through these.
struct Program {
  std::vector<ir::LoweredFunction> functions;
  std::vector<Export> exports;
  std::vector<Dispatch> dispatches;
};
// The parts of one object file, which refer to each other by hidden symbols. The result does not depend on the machine
// that compiles.
std::vector<std::string> compile_parts(const Program& program, const Options& options);

enum class Format { Assembly, LlvmIr, Bitcode };
std::map<Format, std::string> compile_texts(const Program& program, const Options& options,
                                            const std::vector<Format>& formats);

std::string compile_llvm_ir(const ir::LoweredFunction& function, const Options& options);
std::string compile_assembly(const ir::LoweredFunction& function, const Options& options);

}  // namespace retrograde::codegen
