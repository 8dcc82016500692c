// Halide.h -- Retrograde under Halide's names: put this folder first on the include path, and a
// pipeline written for Halide compiles as it stands.
#pragma once

#include <retrograde/retrograde.h>

// Not an alias: HalideBuffer.h opens namespace Halide for Halide::Runtime.
namespace Halide {
using namespace ::retrograde;

// Errors are always exceptions here.
inline bool exceptions_enabled() { return true; }
}  // namespace Halide
