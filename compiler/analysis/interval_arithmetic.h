// Interval arithmetic: the interval of an operation from the intervals of its operands, with the
// meaning of an Interval in bounds_engine.h.
#pragma once

#include <optional>

#include "analysis/interval.h"
#include "ir/expr.h"

namespace retrograde::analysis {

Interval type_range(
    Type type);  // of one lane: bounded for bool and integers below 32 bits, not for floats
Interval constant_interval(Type type, int64_t min, int64_t max);

std::optional<int64_t> constant_min(const Interval& v);  // for integers
std::optional<int64_t> constant_max(const Interval& v);
bool is_nonnegative(const Interval& v);  // when proven

Interval interval_add(Type type, const Interval& a, const Interval& b);
Interval interval_sub(Type type, const Interval& a, const Interval& b);
Interval interval_mul(Type type, const Interval& a, const Interval& b);
Interval interval_fma(const Interval& a, const Interval& b, const Interval& c);
Interval interval_div(Type type, const Interval& a, const Interval& b);
Interval interval_mod(Type type, const Interval& a, const Interval& b);
Interval interval_min(const Interval& a, const Interval& b);
Interval interval_max(const Interval& a, const Interval& b);
Interval interval_clamp(const Interval& v, const Interval& low, const Interval& high);
// A value that lies between two others, for certain. It needs no smallest or largest value of its own to be below or
// above them, which a clamp has to expect.
Interval interval_between(const Interval& v, const Interval& low, const Interval& high);
Interval interval_cast(Type to, Type from, const Interval& v);
Interval interval_abs(Type result, Type operand, const Interval& v);
Interval interval_absd(Type result, Type operand, const Interval& a, const Interval& b);
// and, or, xor of integers
Interval interval_bitwise(Op op, Type type, const Interval& a, const Interval& b);
Interval interval_shift(Op op, Type type, const Interval& a, const Interval& amount);
// For a function that never decreases and maps no number to NaN: applies it to both ends.
Interval interval_monotone(Op op, Type type, const Interval& v);

}  // namespace retrograde::analysis
