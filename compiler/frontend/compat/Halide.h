// Halide.h -- Retrograde under Halide's names: put this folder first on the include path, and a
// pipeline written for Halide 14 compiles as it stands.
#pragma once

#include <retrograde/retrograde.h>

// Not an alias: HalideBuffer.h opens namespace Halide for Halide::Runtime.
namespace Halide {
using namespace ::retrograde;

// Errors are always exceptions here.
inline bool exceptions_enabled() { return true; }
}  // namespace Halide

// ---- macros that programs use ----

#define HALIDE_VERSION_MAJOR 14
#define HALIDE_VERSION_MINOR 0
#define HALIDE_VERSION_PATCH 0
#define HALIDE_VERSION "14.0.0"

#ifndef HALIDE_EXPORT
#define HALIDE_EXPORT __attribute__((visibility("default")))
#endif
#ifndef HALIDE_EXPORT_SYMBOL
#define HALIDE_EXPORT_SYMBOL __attribute__((visibility("default")))
#endif
#define HALIDE_NO_USER_CODE_INLINE __attribute__((noinline))

#define HALIDE_REGISTER_GENERATOR(...) RETROGRADE_REGISTER_GENERATOR(__VA_ARGS__)
#define HALIDE_REGISTER_GENERATOR_ALIAS(...) RETROGRADE_REGISTER_GENERATOR_ALIAS(__VA_ARGS__)

// HALIDE_DECLARE_EXTERN_*: names types behind handles; here all handles are alike.
#define HALIDE_DECLARE_EXTERN_SIMPLE_TYPE(T)
#define HALIDE_DECLARE_EXTERN_STRUCT_TYPE(T)
#define HALIDE_DECLARE_EXTERN_CLASS_TYPE(T)
#define HALIDE_DECLARE_EXTERN_UNION_TYPE(T)
