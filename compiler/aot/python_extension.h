// python_extension.h -- generates a Python extension module from compiled functions: one file of C++17 on Python's C
// API, which also contains the functions' declarations.
//
//   g++ -shared -fPIC $(python3-config --includes) name.py.cpp name.a -o name$(python3-config --extension-suffix)
//
// A function takes its arguments by position or name. A buffer is any object with the buffer protocol that has the
// function's element type and number of dimensions; it is not copied. a[y, x] is f(x, y); for arrays that are
// contiguous only in Fortran order, a[x, y] is. Objects with `_get_raw_halide_buffer_t`, such as retrograde's Python
// Buffers, are passed as they are. A call releases the GIL. An error raises RuntimeError "Halide Runtime Error: <code>"
// with the message in its `text`. Prints of the function go to sys.stdout.
//
// Macros when compiling the file: HALIDE_PYTHON_EXTENSION_MODULE_NAME and _FUNCTIONS, as in X(f) X(g), select another
// module name and list the functions of several files. _OMIT_MODULE_DEFINITION leaves out the module, which another
// file then defines. _OMIT_ERROR_AND_PRINT_HANDLERS leaves errors and prints to the runtime's handlers.
#pragma once

#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

// Without functions: defines a module whose functions are in other files.
// Requires: Python supports the scalars' types (Unsupported).
std::string python_extension_text(const std::string& module_name, const Target& target,
                                  const std::vector<DeclaredFunction>& functions);

}  // namespace retrograde::aot
