// Halide.h -- Retrograde under Halide's names. With this folder first on the include path, a pipeline that was written
// for Halide 14 to 21 compiles without changes.
#pragma once

#include <retrograde/retrograde.h>

#include "generator/execute_generator.h"
#include "porting/internal.h"

// Halide.h of Halide includes these headers, and programs rely on that.
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

// Namespace Halide cannot be an alias, since HalideBuffer.h opens it for Halide::Runtime. Names are imported one by
// one: names that Halide lacks stay in namespace retrograde, so programs may define them.
// clang-format off
namespace Halide {
using ::retrograde::_; using ::retrograde::_0; using ::retrograde::_1; using ::retrograde::_2;
using ::retrograde::_3; using ::retrograde::_4; using ::retrograde::_5; using ::retrograde::_6;
using ::retrograde::_7; using ::retrograde::_8; using ::retrograde::_9; using ::retrograde::abs;
using ::retrograde::absd; using ::retrograde::acos; using ::retrograde::acosh;
using ::retrograde::argmax; using ::retrograde::argmin; using ::retrograde::Argument;
using ::retrograde::ArgumentEstimates; using ::retrograde::asin; using ::retrograde::asinh;
using ::retrograde::atan; using ::retrograde::atan2; using ::retrograde::atanh;
using ::retrograde::AutoSchedulerFn; using ::retrograde::AutoschedulerParams;
using ::retrograde::AutoSchedulerResults; using ::retrograde::BFloat;
using ::retrograde::bfloat16_t; using ::retrograde::Bool; using ::retrograde::Buffer;
using ::retrograde::Callable; using ::retrograde::cast; using ::retrograde::ceil;
using ::retrograde::clamp; using ::retrograde::compile_multitarget;
using ::retrograde::compile_standalone_runtime; using ::retrograde::CompileError;
using ::retrograde::concat_bits; using ::retrograde::cos; using ::retrograde::cosh;
using ::retrograde::count_leading_zeros; using ::retrograde::count_trailing_zeros;
using ::retrograde::create_callable_from_generator; using ::retrograde::Derivative;
using ::retrograde::deserialize_parameters; using ::retrograde::deserialize_pipeline;
using ::retrograde::DeviceAPI; using ::retrograde::div_round_to_zero; using ::retrograde::erf;
using ::retrograde::Error; using ::retrograde::evaluate; using ::retrograde::evaluate_may_gpu;
using ::retrograde::EvictionKey; using ::retrograde::exp; using ::retrograde::Expr;
using ::retrograde::ExprCompare; using ::retrograde::ExternCFunction;
using ::retrograde::ExternFuncArgument; using ::retrograde::ExternSignature;
using ::retrograde::extract_bits; using ::retrograde::fast_cos; using ::retrograde::fast_exp;
using ::retrograde::fast_integer_divide; using ::retrograde::fast_integer_divide_round_to_zero;
using ::retrograde::fast_integer_modulo; using ::retrograde::fast_inverse;
using ::retrograde::fast_inverse_sqrt; using ::retrograde::fast_log; using ::retrograde::fast_pow;
using ::retrograde::fast_sin; using ::retrograde::Float; using ::retrograde::float16_t;
using ::retrograde::floor; using ::retrograde::fma; using ::retrograde::fract; using ::retrograde::Func;
using ::retrograde::FuncRef; using ::retrograde::FuncTupleElementRef; using ::retrograde::gather;
using ::retrograde::Generator; using ::retrograde::GeneratorContext;
using ::retrograde::GeneratorInput; using ::retrograde::GeneratorOutput;
using ::retrograde::GeneratorParam; using ::retrograde::get_default_device_api_for_target;
using ::retrograde::get_device_interface_for_device_api; using ::retrograde::get_host_target;
using ::retrograde::get_jit_target_from_environment;
using ::retrograde::get_target_from_environment; using ::retrograde::halving_add;
using ::retrograde::halving_sub; using ::retrograde::Handle;
using ::retrograde::host_supports_target_device; using ::retrograde::HTML; using ::retrograde::hypot;
using ::retrograde::ImageParam; using ::retrograde::ImplicitVar; using ::retrograde::Int;
using ::retrograde::InternalError; using ::retrograde::is_finite; using ::retrograde::is_inf;
using ::retrograde::is_nan; using ::retrograde::JITExtern; using ::retrograde::JITHandlers;
using ::retrograde::JITUserContext; using ::retrograde::lambda; using ::retrograde::lerp;
using ::retrograde::likely; using ::retrograde::likely_if_innermost;
using ::retrograde::link_modules; using ::retrograde::LinkageType; using ::retrograde::load_plugin;
using ::retrograde::log; using ::retrograde::LoopAlignStrategy; using ::retrograde::LoopLevel;
using ::retrograde::MachineParams; using ::retrograde::max; using ::retrograde::maximum;
using ::retrograde::memoize_tag; using ::retrograde::MemoryType; using ::retrograde::min;
using ::retrograde::minimum; using ::retrograde::mod_round_to_zero; using ::retrograde::Module;
using ::retrograde::ModuleFactory; using ::retrograde::mul_shift_right; using ::retrograde::mux;
using ::retrograde::NameMangling; using ::retrograde::OutputFileType;
using ::retrograde::OutputImageParam; using ::retrograde::Param; using ::retrograde::Parameter;
using ::retrograde::ParamMap; using ::retrograde::Partition; using ::retrograde::Pipeline;
using ::retrograde::popcount; using ::retrograde::pow; using ::retrograde::PrefetchBoundStrategy;
using ::retrograde::print; using ::retrograde::print_when; using ::retrograde::product;
using ::retrograde::propagate_adjoints; using ::retrograde::random_float;
using ::retrograde::random_int; using ::retrograde::random_uint; using ::retrograde::Range;
using ::retrograde::RDom; using ::retrograde::Realization; using ::retrograde::Region;
using ::retrograde::reinterpret; using ::retrograde::require; using ::retrograde::round;
using ::retrograde::rounding_halving_add; using ::retrograde::rounding_mul_shift_right;
using ::retrograde::rounding_shift_left; using ::retrograde::rounding_shift_right;
using ::retrograde::RuntimeError; using ::retrograde::RVar; using ::retrograde::saturating_add;
using ::retrograde::saturating_cast; using ::retrograde::saturating_sub;
using ::retrograde::saturating_sum; using ::retrograde::scatter;
using ::retrograde::ScheduleHandle; using ::retrograde::select;
using ::retrograde::serialize_pipeline; using ::retrograde::sin; using ::retrograde::sinh;
using ::retrograde::sqrt; using ::retrograde::Stage; using ::retrograde::StmtOutputFormat;
using ::retrograde::strict_float; using ::retrograde::sum; using ::retrograde::TailStrategy;
using ::retrograde::tan; using ::retrograde::Text; using ::retrograde::tanh; using ::retrograde::Target;
using ::retrograde::target_feature_for_device_api; using ::retrograde::trunc;
using ::retrograde::Tuple; using ::retrograde::tuple_select; using ::retrograde::Type;
using ::retrograde::type_of; using ::retrograde::UInt; using ::retrograde::undef;
using ::retrograde::unsafe_promise_clamped; using ::retrograde::user_context_value;
using ::retrograde::Var; using ::retrograde::VarOrRVar; using ::retrograde::widen_right_add;
using ::retrograde::widen_right_mul; using ::retrograde::widen_right_sub;
using ::retrograde::widening_add; using ::retrograde::widening_mul;
using ::retrograde::widening_shift_left; using ::retrograde::widening_shift_right;
using ::retrograde::widening_sub;

using ::retrograde::operator!; using ::retrograde::operator!=; using ::retrograde::operator%;
using ::retrograde::operator&; using ::retrograde::operator&&; using ::retrograde::operator*;
using ::retrograde::operator*=; using ::retrograde::operator+; using ::retrograde::operator+=;
using ::retrograde::operator-; using ::retrograde::operator-=; using ::retrograde::operator/;
using ::retrograde::operator/=; using ::retrograde::operator<; using ::retrograde::operator<<;
using ::retrograde::operator<=; using ::retrograde::operator==; using ::retrograde::operator>;
using ::retrograde::operator>=; using ::retrograde::operator>>; using ::retrograde::operator^;
using ::retrograde::operator|; using ::retrograde::operator||; using ::retrograde::operator~;

using ::retrograde::porting::CompileTimeErrorReporter;
using ::retrograde::porting::set_custom_compile_time_error_reporter;
using ::retrograde::NamesInterface;
// clang-format on
namespace BoundaryConditions = ::retrograde::BoundaryConditions;
namespace ConciseCasts = ::retrograde::ConciseCasts;

constexpr int AnyDims = Runtime::AnyDims;
using GeneratorParamsMap = std::map<std::string, std::string>;

// Always true: errors are exceptions.
inline bool exceptions_enabled() { return true; }

// Has no effect: programs are compiled on a separate, large stack; see diagnostics/large_stack.h.
inline void set_compiler_stack_size(size_t) {}
inline size_t get_compiler_stack_size() { return size_t{1} << 30; }

// Halide::Internal is a separate namespace. Retrograde's has another name, so Internal:: stays unambiguous after
// `using namespace Halide` in programs that add to this namespace.
namespace Internal {
using namespace ::retrograde::internal;
using namespace ::retrograde::porting;
using ::retrograde::Dimension;
using ::retrograde::ForType;
// Warnings are printed by default, as in Halide. retrograde::set_warning_handler({}) silences them; a reporter or a
// WarningScope receives them instead.
inline const bool prints_warnings = ::retrograde::porting::print_warnings_by_default();
}  // namespace Internal
}  // namespace Halide

// Makes argument-dependent lookup find these for Exprs without Internal::, as in Halide, where the base class of Expr
// is in Internal.
namespace retrograde::ir {
using porting::can_prove;
using porting::is_const;
using porting::is_const_one;
using porting::is_const_power_of_two_integer;
using porting::is_const_zero;
using porting::is_negative_const;
using porting::is_positive_const;
using porting::is_pure;
using porting::simplify;
}  // namespace retrograde::ir

// ---- Halide's macros ----

#define HALIDE_VERSION_MAJOR 21
#define HALIDE_VERSION_MINOR 0
#define HALIDE_VERSION_PATCH 0
#define HALIDE_VERSION "21.0.0"
#ifndef HALIDE_WITH_EXCEPTIONS
#define HALIDE_WITH_EXCEPTIONS
#endif

// Stream a message that is thrown unless the condition holds: _halide_user_assert(x.defined()) << "no x\n";
#define RETROGRADE_REPORT(condition, kind)                                                     \
  (condition)                                                                                  \
      ? (void)0                                                                                \
      : ::retrograde::porting::Voidifier() &                                                   \
            ::retrograde::porting::ErrorReport(__FILE__, __LINE__, #condition,                 \
                                               ::retrograde::porting::ErrorReport::Kind::kind) \
                .ref()
#define _halide_user_assert(condition) RETROGRADE_REPORT(condition, User)
#ifdef HALIDE_KEEP_MACROS
#define user_assert(condition) RETROGRADE_REPORT(condition, User)
#define internal_assert(condition) RETROGRADE_REPORT(condition, Internal)
#define RETROGRADE_REPORT_ALWAYS(kind)                                               \
  ::retrograde::porting::ErrorReport(__FILE__, __LINE__, nullptr,                    \
                                     ::retrograde::porting::ErrorReport::Kind::kind) \
      .ref()
#define user_error RETROGRADE_REPORT_ALWAYS(User)
#define user_warning RETROGRADE_REPORT_ALWAYS(Warning)
#define internal_error RETROGRADE_REPORT_ALWAYS(Internal)
#endif

#ifndef HALIDE_EXPORT
#define HALIDE_EXPORT __attribute__((visibility("default")))
#endif
#ifndef HALIDE_EXPORT_SYMBOL
#define HALIDE_EXPORT_SYMBOL __attribute__((visibility("default")))
#endif
#define HALIDE_NO_USER_CODE_INLINE __attribute__((noinline))

// Halide's registration macros declare this at global scope.
namespace halide_register_generator {
struct halide_global_ns;
}
#define HALIDE_REGISTER_GENERATOR(...) RETROGRADE_REGISTER_GENERATOR(__VA_ARGS__)
#define HALIDE_REGISTER_GENERATOR_ALIAS(...) RETROGRADE_REGISTER_GENERATOR_ALIAS(__VA_ARGS__)

// Defines name(a1, ...), which calls the C function of that name through `call`.
#define RETROGRADE_EXTERN_1(call, rt, name, t1) \
  Halide::Expr name(const Halide::Expr& a1) { return ::retrograde::call<rt, t1>(#name, a1); }
#define RETROGRADE_EXTERN_2(call, rt, name, t1, t2)                   \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2) { \
    return ::retrograde::call<rt, t1, t2>(#name, a1, a2);             \
  }
#define RETROGRADE_EXTERN_3(call, rt, name, t1, t2, t3)                                       \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3) { \
    return ::retrograde::call<rt, t1, t2, t3>(#name, a1, a2, a3);                             \
  }
#define RETROGRADE_EXTERN_4(call, rt, name, t1, t2, t3, t4)                                 \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3, \
                    const Halide::Expr& a4) {                                               \
    return ::retrograde::call<rt, t1, t2, t3, t4>(#name, a1, a2, a3, a4);                   \
  }
#define RETROGRADE_EXTERN_5(call, rt, name, t1, t2, t3, t4, t5)                             \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3, \
                    const Halide::Expr& a4, const Halide::Expr& a5) {                       \
    return ::retrograde::call<rt, t1, t2, t3, t4, t5>(#name, a1, a2, a3, a4, a5);           \
  }
#define RETROGRADE_EXTERN_6(call, rt, name, t1, t2, t3, t4, t5, t6)                           \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,   \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6) { \
    return ::retrograde::call<rt, t1, t2, t3, t4, t5, t6>(#name, a1, a2, a3, a4, a5, a6);     \
  }
#define RETROGRADE_EXTERN_7(call, rt, name, t1, t2, t3, t4, t5, t6, t7)                           \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,       \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6,       \
                    const Halide::Expr& a7) {                                                     \
    return ::retrograde::call<rt, t1, t2, t3, t4, t5, t6, t7>(#name, a1, a2, a3, a4, a5, a6, a7); \
  }
#define RETROGRADE_EXTERN_8(call, rt, name, t1, t2, t3, t4, t5, t6, t7, t8)                      \
  Halide::Expr name(const Halide::Expr& a1, const Halide::Expr& a2, const Halide::Expr& a3,      \
                    const Halide::Expr& a4, const Halide::Expr& a5, const Halide::Expr& a6,      \
                    const Halide::Expr& a7, const Halide::Expr& a8) {                            \
    return ::retrograde::call<rt, t1, t2, t3, t4, t5, t6, t7, t8>(#name, a1, a2, a3, a4, a5, a6, \
                                                                  a7, a8);                       \
  }
#define HalideExtern_1(...) RETROGRADE_EXTERN_1(call_c_function, __VA_ARGS__)
#define HalideExtern_2(...) RETROGRADE_EXTERN_2(call_c_function, __VA_ARGS__)
#define HalideExtern_3(...) RETROGRADE_EXTERN_3(call_c_function, __VA_ARGS__)
#define HalideExtern_4(...) RETROGRADE_EXTERN_4(call_c_function, __VA_ARGS__)
#define HalideExtern_5(...) RETROGRADE_EXTERN_5(call_c_function, __VA_ARGS__)
#define HalideExtern_6(...) RETROGRADE_EXTERN_6(call_c_function, __VA_ARGS__)
#define HalideExtern_7(...) RETROGRADE_EXTERN_7(call_c_function, __VA_ARGS__)
#define HalideExtern_8(...) RETROGRADE_EXTERN_8(call_c_function, __VA_ARGS__)
#define HalidePureExtern_1(...) RETROGRADE_EXTERN_1(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_2(...) RETROGRADE_EXTERN_2(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_3(...) RETROGRADE_EXTERN_3(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_4(...) RETROGRADE_EXTERN_4(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_5(...) RETROGRADE_EXTERN_5(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_6(...) RETROGRADE_EXTERN_6(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_7(...) RETROGRADE_EXTERN_7(call_pure_c_function, __VA_ARGS__)
#define HalidePureExtern_8(...) RETROGRADE_EXTERN_8(call_pure_c_function, __VA_ARGS__)

// Throws CompileError unless argument number `k` of the function `name` has the type.
#define _halide_check_arg_type(t, name, e, k)                                     \
  _halide_user_assert((e).type() == (t)) << "argument " << (k) << " of " << #name \
                                         << " has the type " << (t) << ", not " << (e).type()

// These macros of Halide name the types behind handles. Here all handles have one type, so they are empty.
#define HALIDE_DECLARE_EXTERN_SIMPLE_TYPE(T)
#define HALIDE_DECLARE_EXTERN_STRUCT_TYPE(T)
#define HALIDE_DECLARE_EXTERN_CLASS_TYPE(T)
#define HALIDE_DECLARE_EXTERN_UNION_TYPE(T)
