// What is true of the operators. Every fact has its column here and is stated for every operator,
// in its row of operators.def; a fact that a row leaves out does not compile. What higher layers
// add (the derivative rules, machine code) is registered there by Op, and totality tests hold it
// against these rows.
#pragma once

#include <cstdint>
#include <string>

#include "ir/type.h"

namespace retrograde::ir {

struct Scalar;

enum class Op : uint8_t {
#define RETROGRADE_OP(name, ...) name,
#include "ir/operators.def"
  none,
};
constexpr int op_count = static_cast<int>(Op::none);

// In every column, 0 is what nobody stated: it has no name.
enum class OpClass : uint8_t {
  Pure = 1,  // a function of its arguments, result type per ir/build.h
  Marker,    // the value of its first argument, with a hint or promise attached
  Effect,    // has an effect or an identity beyond its value (print, require, random, undef)
  Internal,  // made by lowering only, never by users
};

// What bounds of the operands say of the value.
enum class BoundsRule : uint8_t {
  OfType = 1,  // nothing
  OfFirst,     // it is the first operand
  OfSecond,    // it is the second operand
  AtEnds,      // it lies between the values at the operand's ends: rises, and is exact
  Within,      // it lies within `values` unless it is NaN
  ByRule,      // by a rule in analysis/bounds_engine.cpp
};

// What a value that is a number lies within, whatever the operands, rounding errors included.
struct Values {
  double low = 0, high = 0;
};

enum class Monotone : uint8_t { Rises = 1, Falls, Turns };  // in every operand

enum class Infinite : uint8_t {  // the value, at finite operands
  StaysFinite = 1,
  AsSums,     // where a sum or a product of the operands would overflow, too
  Explodes,   // where operands are large, long before a product of them would be infinite
  Somewhere,  // or as large as can be, as at a pole
};

enum class Nan : uint8_t {  // the value, where no operand is NaN
  NoNan = 1,
  NanAtInfinity,  // where an operand is infinite, only
  NanOutside,     // outside of the domain
};

enum class Levels : uint8_t {  // where an operand is infinite
  NeverLevel = 1,
  LevelsOff,  // somewhere the value is finite and the partial 0: exp at -inf
};

enum class PartialPoles : uint8_t {  // whether a partial may be infinite where the value is finite
  NoPoles = 1,
  Poles,          // sqrt at 0
  PolesBelowOne,  // where the last operand, an exponent, is below 1
};

// How far the value that generated code computes may be from the exact one.
struct OpError {
  enum class Kind : uint8_t {
      Exact = 1,     // rounded once, correctly
    Arithmetic,    // computed by sums, products and quotients, each of which is rounded
    Library,       // of a function of codegen/math_table.h, at most so many ULP
    Approximates,  // of a function of codegen's table of fast ones, with its domain and error
  };
  Kind kind = {};
  double ulp_float32 = 0, ulp_float64 = 0;  // Library: what we promise for the host
  int ulp_elsewhere = 0;                    // Library: of any implementation that is correct
  Op of = Op::none;                         // Approximates: this operator, where there is one
};

// Of a function of real numbers.
struct RealFacts {
  Monotone monotone = {};
  Infinite infinite = {};
  Nan nan = {};
  Levels levels = {};
  PartialPoles poles = {};
  OpError error = {};
};

// Floating-point operations (integers are places and borders: not counted).
struct Work {
  int adds = -1;       // + and -, and what costs as little: comparisons, choices, rounding
  int mults = -1;      // * and /
  int functions = -1;  // sqrt, exp, sin and the like
  int function_adds = 0;  // that the functions take as long as, in vectors of float32
};

// Beyond giving a value.
enum class Conduct : uint8_t {
  Silent = 1,
  Acts,         // does something, once for all uses of one node
  InPlace,      // does nothing, but two equal ones are not one
  ActsInPlace,  // both
};

constexpr int any_number = -1;
constexpr int unstated_arity = -2;
using OpValue = Scalar (*)(const Scalar& a, const Scalar& b, const Scalar& c, Type type);

struct OpInfo {
  const char* name;
  int arity = unstated_arity;
  OpClass cls = {};
  OpValue value = nullptr;  // Pure and Marker: of scalars; `type` is the call's
  BoundsRule bounds = {};
  Values values = {};
  RealFacts real = {};
  Work work = {};
  Conduct conduct = {};
};

// The first column that the row leaves out; null when it is complete.
constexpr const char* unstated_column(const OpInfo& row) {
  const RealFacts& real = row.real;
  if (row.arity == unstated_arity) return "arity";
  if (row.cls == OpClass{}) return "class";
  if (row.value == nullptr) return "value";
  if (row.bounds == BoundsRule{}) return "bounds";
  if (!(row.values.low < row.values.high)) return "values";
  if (real.monotone == Monotone{}) return "monotone";
  if (real.infinite == Infinite{}) return "infinite";
  if (real.nan == Nan{}) return "nan";
  if (real.levels == Levels{}) return "levels";
  if (real.poles == PartialPoles{}) return "poles";
  if (real.error.kind == OpError::Kind{}) return "error";
  if (row.work.functions < 0 || (row.work.functions > 0) != (row.work.function_adds > 0))
    return "work";
  return row.conduct == Conduct{} ? "conduct" : nullptr;
}

const OpInfo& op_info(Op op);
Op op_from_name(const std::string& name);  // Op::none when unknown

// The operand whose value the call has; -1: it has one of its own.
int passed_operand(Op op);
// Whether the value may be infinite or NaN at finite operands, but by overflow of a sum or product.
bool is_risky_op(Op op);
// Whether a call does something beyond giving a value.
bool acts(Op op);
// The operator that this one approximates, or itself.
Op exact_form(Op op);

}  // namespace retrograde::ir
