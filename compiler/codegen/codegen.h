// Machine code from a lowered function. Nothing of LLVM shows here.
//
// A module holds `int32 name(context, args...)` and `int32 name_argv(context, void **args)`, as the
// runtime's header describes. Compilations share nothing and may run at once on several threads.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "codegen/exports.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde::codegen {

// Whether RETROGRADE_GPU is "simulated".
bool is_gpu_simulated();

struct Options {
  Target target = get_host_target();
  // Choose instructions for the processor that this runs on, within the target's features.
  bool tune_for_host = true;
  // 0: straight from the IR; 1: what the passes of optimize.cpp make of it.
  int optimization_level = 1;
  // Kernels for the executor, too, which RETROGRADE_GPU=simulated asks for.
  bool kernels_for_executor = is_gpu_simulated();
  // Into how many parts a program is cut, which are compiled at the same time. 0: what its size
  // suggests; of compile_object, at most the machine's cores.
  unsigned parts = 0;
};

struct Times {
  double generate_seconds = 0;  // our IR to LLVM's
  double optimize_seconds = 0;
  double emit_seconds = 0;  // LLVM's IR to bytes or text
};

struct Module {
  std::vector<uint8_t> object;         // ELF, relocatable; of several parts an archive of such
  std::vector<std::string> externals;  // symbols that it needs, sorted
  Times times;
};

// InternalError when the function is not what lowering promises; Unsupported for a target without a
// code generator.
Module compile_object(const ir::LoweredFunction& function, const Options& options);

// Ahead of time: functions that the exports refer to are reached through these alone.
struct Program {
  std::vector<ir::LoweredFunction> functions;
  std::vector<Export> exports;
  std::vector<Dispatch> dispatches;
};
// The parts of one object file, which refer to each other by hidden symbols. The same whatever the
// machine that it runs on.
std::vector<std::string> compile_parts(const Program& program, const Options& options);

enum class Format { Assembly, LlvmIr, Bitcode };
std::map<Format, std::string> compile_texts(const Program& program, const Options& options,
                                            const std::vector<Format>& formats);

std::string compile_llvm_ir(const ir::LoweredFunction& function, const Options& options);
std::string compile_assembly(const ir::LoweredFunction& function, const Options& options);

}  // namespace retrograde::codegen
