// Names of functions as linker symbols, and argument types as C source.
#pragma once

#include <string>
#include <vector>

#include "codegen/cpu/exports.h"

namespace retrograde::aot {

// The parts of a name between "::".
std::vector<std::string> name_parts(const std::string& name);
// "uint8_t", "struct halide_buffer_t *".
std::string c_type(const codegen::ExportArgument& argument);
// The symbol of `int name(arguments...)` in C++.
std::string mangled(const std::string& name, const std::vector<codegen::ExportArgument>& arguments);
// The symbols of `int name(void **)` and of `const halide_filter_metadata_t *name()`.
std::string mangled_argv(const std::string& name);
std::string mangled_metadata(const std::string& name);

}  // namespace retrograde::aot
