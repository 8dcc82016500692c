// module_files.h -- compiles the front end's Modules to files. All outputs are generated first; then all files are
// written together.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "frontend/run/module.h"

namespace retrograde::aot {

using Files = std::map<OutputFileType, std::string>;  // paths by their kind

// Throws Unsupported for a target that has no code generator, before any work.
void check_target(const Target& target);
// Tells whoever collects warnings which kernels keep arrays outside of registers.
void tell_kernel_notes(const ir::LoweredFunction& function, const Target& target);

std::vector<uint8_t> object_of(const Module& module);
void write_module(const Module& module, const Files& output_files);
// modules[i] is for targets[i], and its function has a name of its own; the wrapper is called `function_name`. There is
// one suffix for each target.
void write_multitarget(const std::string& function_name, const std::vector<Module>& modules,
                       const std::vector<std::string>& suffixes, const Files& output_files);
void write_runtime(const Files& output_files, const Target& target);

}  // namespace retrograde::aot
