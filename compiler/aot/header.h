// Generates the C and C++ header of compiled functions, and code that registers them.
#pragma once

#include <string>
#include <vector>

#include "codegen/cpu/exports.h"
#include "frontend/run/module.h"

namespace retrograde::aot {

struct DeclaredFunction {
  std::string name;  // including its namespaces
  codegen::Signature signature;
};

// Makes a C identifier: every other character becomes an underscore.
std::string identifier(const std::string& text);
// Wraps `text` in the namespaces of the function `name`.
std::string in_namespaces(const std::string& name, const std::string& text);

std::string header_text(const std::string& module_name, const Target& target,
                        const std::vector<DeclaredFunction>& functions);
// Generates C++ that registers each function at program start, by calling halide_register_argv_and_metadata. The
// program defines that function.
std::string registration_text(const std::vector<DeclaredFunction>& functions, const Target& target);

}  // namespace retrograde::aot
