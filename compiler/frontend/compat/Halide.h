// Halide.h -- Retrograde under Halide's names: put this folder first on the include path, and a
// pipeline written for Halide 14 compiles as it stands.
#pragma once

#include <retrograde/retrograde.h>

// Programs rely on these.
#include <algorithm>
#include <array>
#include <atomic>
#include <bitset>
#include <cassert>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <future>
#include <initializer_list>
#include <iostream>
#include <iterator>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <queue>
#include <random>
#include <set>
#include <sstream>
#include <stack>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

// Not an alias: HalideBuffer.h opens namespace Halide for Halide::Runtime.
namespace Halide {
using namespace ::retrograde;

// Errors are always exceptions here.
inline bool exceptions_enabled() { return true; }

// Deep programs are compiled on a stack of its own, as large as they need.
inline void set_compiler_stack_size(size_t) {}
inline size_t get_compiler_stack_size() { return size_t{1} << 30; }
// A namespace of its own: ours has another name, so that programs which add to this one can still
// say Internal:: behind `using namespace Halide`.
namespace Internal {
using namespace ::retrograde::internal;
}
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

// Declared by what registers generators: at global scope.
namespace halide_register_generator {
struct halide_global_ns;
}
#define HALIDE_REGISTER_GENERATOR(...) RETROGRADE_REGISTER_GENERATOR(__VA_ARGS__)
#define HALIDE_REGISTER_GENERATOR_ALIAS(...) RETROGRADE_REGISTER_GENERATOR_ALIAS(__VA_ARGS__)

// name(a1, ...): calls the C function of that name.
#define HalideExtern_1(rt, name, t1) \
  Halide::Expr name(const Halide::Expr& a1) { return Halide::call_c_function<rt, t1>(#name, a1); }
#define HalideExtern_2(rt, name, t1, t2)                              \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2) { \
    return Halide::call_c_function<rt, t1, t2>(#name, a1, a2);        \
  }
#define HalideExtern_3(rt, name, t1, t2, t3)                                                  \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3) { \
    return Halide::call_c_function<rt, t1, t2, t3>(#name, a1, a2, a3);                        \
  }
#define HalideExtern_4(rt, name, t1, t2, t3, t4)                                            \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3, \
                    const Halide::Expr& a4) {                                               \
    return Halide::call_c_function<rt, t1, t2, t3, t4>(#name, a1, a2, a3, a4);              \
  }
#define HalideExtern_5(rt, name, t1, t2, t3, t4, t5)                                        \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3, \
                    const Halide::Expr& a4, const Halide::Expr& a5) {                       \
    return Halide::call_c_function<rt, t1, t2, t3, t4, t5>(#name, a1, a2, a3, a4, a5);      \
  }
#define HalideExtern_6(rt, name, t1, t2, t3, t4, t5, t6)                                       \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,    \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6) {  \
    return Halide::call_c_function<rt, t1, t2, t3, t4, t5, t6>(#name, a1, a2, a3, a4, a5, a6); \
  }
#define HalideExtern_7(rt, name, t1, t2, t3, t4, t5, t6, t7)                                      \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,       \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6,       \
                    const Halide::Expr& a7) {                                                     \
    return Halide::call_c_function<rt, t1, t2, t3, t4, t5, t6, t7>(#name, a1, a2, a3, a4, a5, a6, \
                                                                   a7);                           \
  }
#define HalideExtern_8(rt, name, t1, t2, t3, t4, t5, t6, t7, t8)                                  \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,       \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6,       \
                    const Halide::Expr& a7, const Halide::Expr& a8) {                             \
    return Halide::call_c_function<rt, t1, t2, t3, t4, t5, t6, t7, t8>(#name, a1, a2, a3, a4, a5, \
                                                                       a6, a7, a8);               \
  }
#define HalidePureExtern_1(rt, name, t1) HalideExtern_1(rt, name, t1)
#define HalidePureExtern_2(rt, name, t1, t2) HalideExtern_2(rt, name, t1, t2)
#define HalidePureExtern_3(rt, name, t1, t2, t3) HalideExtern_3(rt, name, t1, t2, t3)
#define HalidePureExtern_4(rt, name, t1, t2, t3, t4) HalideExtern_4(rt, name, t1, t2, t3, t4)
#define HalidePureExtern_5(rt, name, t1, t2, t3, t4, t5) \
  HalideExtern_5(rt, name, t1, t2, t3, t4, t5)
#define HalidePureExtern_6(rt, name, t1, t2, t3, t4, t5, t6) \
  HalideExtern_6(rt, name, t1, t2, t3, t4, t5, t6)
#define HalidePureExtern_7(rt, name, t1, t2, t3, t4, t5, t6, t7) \
  HalideExtern_7(rt, name, t1, t2, t3, t4, t5, t6, t7)
#define HalidePureExtern_8(rt, name, t1, t2, t3, t4, t5, t6, t7, t8) \
  HalideExtern_8(rt, name, t1, t2, t3, t4, t5, t6, t7, t8)

// HALIDE_DECLARE_EXTERN_*: names types behind handles; here all handles are alike.
#define HALIDE_DECLARE_EXTERN_SIMPLE_TYPE(T)
#define HALIDE_DECLARE_EXTERN_STRUCT_TYPE(T)
#define HALIDE_DECLARE_EXTERN_CLASS_TYPE(T)
#define HALIDE_DECLARE_EXTERN_UNION_TYPE(T)
