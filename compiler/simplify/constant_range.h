// Arithmetic on constant ranges: ranges of integers whose ends saturate, and at which the extremes of int64 mean
// infinity.
#pragma once

#include <cstdint>

#include "ir/interval.h"

namespace retrograde::simplification {

constexpr int64_t infinity = INT64_MAX;
int64_t saturate(__int128 value);
int64_t add_ends(int64_t a, int64_t b);

// The range of values of a type.
ConstantRange range_of(Type type);
ConstantRange operator+(const ConstantRange& a, const ConstantRange& b);
ConstantRange operator*(const ConstantRange& a, int64_t factor);
ConstantRange multiply(const ConstantRange& a, const ConstantRange& b);
ConstantRange divide(const ConstantRange& a, const ConstantRange& b);
ConstantRange modulo(const ConstantRange& a, const ConstantRange& b);
// The range of a result that wraps in the type, unless the type is one that does not overflow.
ConstantRange wrapped(const ConstantRange& r, Type type);

}  // namespace retrograde::simplification
