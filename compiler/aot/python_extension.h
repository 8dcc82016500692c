// python_extension.h -- compiled functions as functions of a Python module: C++17 over Python's C API, in one file that
// holds their declarations, too.
//
//   g++ -shared -fPIC $(python3-config --includes) name.py.cpp name.a -o name$(python3-config --extension-suffix)
//
// A function takes its arguments in order or by name. Buffers are what has the buffer protocol, of the function's
// element type and as many dimensions, and are not copied: a[y, x] is f(x, y), and a[x, y] of arrays in Fortran's order
// (contiguous in that one alone). Objects with `_get_raw_halide_buffer_t`, as Buffers of Python have it, are taken as
// they are. The GIL is free during a call. An error is a RuntimeError "Halide Runtime Error: <code>" whose `text` says
// what was wrong. What the function prints goes to sys.stdout.
//
// Macros, when the file is compiled: HALIDE_PYTHON_EXTENSION_MODULE_NAME and _FUNCTIONS, as in X(f) X(g), name another
// module and the functions of several files; with _OMIT_MODULE_DEFINITION the file has functions alone, for a module
// that another file defines; with _OMIT_ERROR_AND_PRINT_HANDLERS errors and prints go where the runtime sends them.
#pragma once

#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

// Without functions: the definition of a module whose functions other files have.
// Requires: Python has numbers for the scalars (Unsupported).
std::string python_extension_text(const std::string& module_name, const Target& target,
                                  const std::vector<DeclaredFunction>& functions);

}  // namespace retrograde::aot
