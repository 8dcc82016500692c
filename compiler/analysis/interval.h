// Symbolic interval arithmetic: the range of an expression as two expressions, given the ranges of
// its variables. It is sound: the interval contains every value that occurs (integers of 32 bits
// and more are assumed not to overflow).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/scope.h"
#include "ir/interval.h"

namespace retrograde::analysis {

Interval hull(const Interval& a, const Interval& b);  // the smallest interval around both
Interval intersection(const Interval& a, const Interval& b);

// One interval per dimension, dimension 0 first.
using Box = std::vector<Interval>;
Box hull(const Box& a, const Box& b);  // an empty vector is an empty hull

// Bounds of `e`. Variables in `variables` range over their intervals, whose ends may mention other
// variables; all other variables are symbols.
// - Calls of Funcs take the range in `values`, by Func name and value index. Without one, and for
//   loads, it is the range of the type (unbounded for floats and integers of 32 bits and more).
// - Integer types below 32 bits that might wrap, and casts to them, give the range of the type.
// - A float interval with a defined end also means "not NaN".
// - Ends are canonical (linear.h). Correlated terms are handled where that is cheap: x - x/2*2,
//   clamp, min and max of shifted terms, select with a condition on its variable.
using ValueBounds = std::map<std::pair<std::string, int>, Interval>;
Interval bounds_of(const Expr& e, const Scope<Interval>& variables,
                   const ValueBounds* values = nullptr);

// For each Func, image and buffer that `e` calls, by name: the hull of the coordinates read. Reads
// in an arm of `if_then_else` are narrowed by its condition. Reads in an arm of a select are not,
// since both arms may be evaluated. Lets inside `e` are handled. The cost is linear in the size of
// the DAG.
struct Footprint {
  Box box;
  bool is_image = false;
  SymbolRef symbol;
};
std::map<std::string, Footprint> footprints(const Expr& e, const Scope<Interval>& variables,
                                            const ValueBounds* values = nullptr);
void merge_footprints(std::map<std::string, Footprint>& into,
                      const std::map<std::string, Footprint>& from);

}  // namespace retrograde::analysis
