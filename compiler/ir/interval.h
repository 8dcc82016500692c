// Closed intervals, one template for every type of end.
//
// Ends are expressions for symbolic intervals, integers for the constant range of a node, and
// doubles for the range of a value. Expressions alone would not do: simplification needs the range
// of every node, where integers cost nothing. This file defines the intervals; arithmetic on them
// differs for each kind of end (integers saturate, doubles round, expressions fold) and lives
// beside each use.
#pragma once

#include <algorithm>
#include <limits>
#include <type_traits>

#include "ir/expr.h"

namespace retrograde::ir {

// The representation of an unbounded end, and equality of ends.
template <class End>
struct EndOf {
  using Limits = std::numeric_limits<End>;
  static End lowest() { return Limits::has_infinity ? -Limits::infinity() : Limits::min(); }
  static End highest() { return Limits::has_infinity ? Limits::infinity() : Limits::max(); }
  static bool are_same(End a, End b) { return a == b; }
  static bool is_bound(End end) { return end != lowest() && end != highest(); }
};
template <>
struct EndOf<Expr> {
  static Expr lowest() { return {}; }
  static Expr highest() { return {}; }
  static bool are_same(const Expr& a, const Expr& b) { return a.defined() && a.same_as(b); }
  static bool is_bound(const Expr& end) { return end.defined(); }
};

template <class End>
struct IntervalOf {
  End min = EndOf<End>::lowest(), max = EndOf<End>::highest();
  static IntervalOf everything() { return {}; }
  static IntervalOf point(End e) { return {e, e}; }
  bool has_lower_bound() const { return EndOf<End>::is_bound(min); }
  bool has_upper_bound() const { return EndOf<End>::is_bound(max); }
  bool is_bounded() const { return has_lower_bound() && has_upper_bound(); }
  bool is_point() const { return EndOf<End>::are_same(min, max); }
  End extent() const { return max - min + 1; }  // of a bounded interval
  bool contains(End value) const { return min <= value && value <= max; }
  bool is_within(const IntervalOf& outer) const { return min >= outer.min && max <= outer.max; }
  bool operator==(const IntervalOf&) const = default;
};

// An undefined end means unbounded.
using Interval = IntervalOf<Expr>;
// The extremes of int64 mean unbounded.
using ConstantRange = IntervalOf<int64_t>;

// Hull and intersection of numeric intervals.
template <class End>
requires std::is_arithmetic_v<End> IntervalOf<End> hull(const IntervalOf<End>& a,
                                                        const IntervalOf<End>& b) {
  return {std::min(a.min, b.min), std::max(a.max, b.max)};
}
template <class End>
requires std::is_arithmetic_v<End> IntervalOf<End> intersection(const IntervalOf<End>& a,
                                                                const IntervalOf<End>& b) {
  return {std::max(a.min, b.min), std::min(a.max, b.max)};
}

}  // namespace retrograde::ir
