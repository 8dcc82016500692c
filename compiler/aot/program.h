// From a Module to what codegen compiles: its functions and how callers reach them.
#pragma once

#include <string>
#include <vector>

#include "codegen/codegen.h"
#include "frontend/run/module.h"

namespace retrograde::aot {

// Functions of the module and of its submodules that callers can reach.
std::vector<internal::LoweredFunc> exported_functions(const Module& module);

codegen::Signature signature_of(const internal::LoweredFunc& function, const Module& module);
codegen::Program program_of(const Module& module);

// The function that chooses among modules[i], which were made for their own targets.
codegen::Program dispatcher(const std::string& function_name, const std::vector<Module>& modules);
// As `dispatcher` presents it.
codegen::Signature dispatcher_signature(const std::string& function_name, const Module& baseline);

}  // namespace retrograde::aot
