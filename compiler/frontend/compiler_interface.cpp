// compiler_interface.cpp -- the compiler of programs that link the front end alone: none.
#include "frontend/compiler_interface.h"

#include "diagnostics/error.h"

namespace retrograde {

// Weak: compiler/jit's definition wins wherever it is linked in.
__attribute__((weak)) Compiler& default_compiler() {
  unsupported("compile a pipeline", "this program must be linked with the compiler",
              "it is linked with the front end alone", "Link libretrograde");
}

}  // namespace retrograde
