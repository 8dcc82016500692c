// The header of compiled functions, for C and C++, and code that registers them.
#pragma once

#include <string>
#include <vector>

#include "codegen/exports.h"
#include "frontend/run/module.h"

namespace retrograde::aot {

struct DeclaredFunction {
  std::string name;  // with its namespaces
  codegen::Signature signature;
};

// As a name of C: letters, digits, and underscores for the rest.
std::string identifier(const std::string& text);
// Around `text`, the namespaces of the function `name`.
std::string in_namespaces(const std::string& name, const std::string& text);

std::string header_text(const std::string& module_name, const Target& target,
                        const std::vector<DeclaredFunction>& functions);
// C++ that tells halide_register_argv_and_metadata, which the program defines, of each function as
// soon as the program starts.
std::string registration_text(const std::vector<DeclaredFunction>& functions, const Target& target);

}  // namespace retrograde::aot
