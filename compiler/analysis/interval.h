// Symbolic interval arithmetic: between what two expressions does a value lie, when variables lie
// in given intervals? Sound: the interval contains every value that occurs (integers are assumed
// not to overflow at 32 bits and up).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/scope.h"
#include "ir/interval.h"

namespace retrograde::analysis {

Interval hull(const Interval& a, const Interval& b);  // smallest interval around both
Interval intersection(const Interval& a, const Interval& b);

// One interval per dimension, dimension 0 first.
using Box = std::vector<Interval>;
Box hull(const Box& a, const Box& b);  // an empty vector stands for "nothing yet"

// Bounds of `e`. Variables in `variables` range over their interval (whose ends may mention other
// variables); any other variable is a symbol and stands for itself. Loads and calls of Funcs:
// `values` gives the range of a called value by Func name and value index when known, else the
// range of the type (floats and integers of 32 bits and more: unbounded). Narrow integer types
// (below 32 bits) that might wrap, and casts to them, give the type's range. A float interval with
// an end says "not NaN" as well. Ends are canonical (linear.h). Correlated terms are handled where
// cheap: x - x/2*2, clamp, min and max of shifted terms, select with a condition on its variable.
using ValueBounds = std::map<std::pair<std::string, int>, Interval>;
Interval bounds_of(const Expr& e, const Scope<Interval>& variables,
                   const ValueBounds* values = nullptr);

// For each Func, image and buffer called by `e` (by name): the hull of the coordinates read. A read
// in an arm of `if_then_else` is narrowed by its condition; one in an arm of a select is not, since
// both arms may be evaluated. Lets inside e are handled. Cost is linear in the DAG's size.
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
