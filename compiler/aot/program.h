// Translates a Module to codegen's input: its functions, and the entry points through which callers reach them.
#pragma once

#include <string>
#include <vector>

#include "codegen/codegen.h"
#include "frontend/run/module.h"

namespace retrograde::aot {

// The functions of the module and its submodules that callers can reach.
std::vector<internal::LoweredFunc> exported_functions(const Module& module);

codegen::Signature signature_of(const internal::LoweredFunc& function, const Module& module);
codegen::Program program_of(const Module& module);

// The function that dispatches among modules[i], each of which was compiled for its own target.
codegen::Program dispatcher(const std::string& function_name, const std::vector<Module>& modules);
// The signature of the function that `dispatcher` makes.
codegen::Signature dispatcher_signature(const std::string& function_name, const Module& baseline);

}  // namespace retrograde::aot
