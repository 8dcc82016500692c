// Simplification of expressions and statements: fewer operations, canonical index arithmetic,
// decided conditions.
//
// Integers of type Int(32) and Int(64) are assumed not to overflow, as everywhere in the language,
// nor are sums of parts of such an expression in another order (they cannot while parts stay below
// half of the type's range). Other integer types wrap exactly. Floats: only rewrites that keep
// every bit of every result (one NaN is as good as another). Cost is about linear in the number of
// nodes of the DAG. Names must be unique (ir/validate.h) and stay so.
#pragma once

#include <string>
#include <unordered_map>

#include "ir/interval.h"

namespace retrograde::simplification {

// What variables lie between. Ends may mention other variables.
using BoundsMap = std::unordered_map<std::string, Interval>;

Expr simplify(const Expr& e, const BoundsMap& bounds = {});

// Also: drops dead and inlines trivial lets, drops loops that run zero times and branches never
// taken, replaces loops that run once by their body, uses loop bounds, conditions and asserts
// inside what they guard. The empty statement is an undefined Stmt.
Stmt simplify(const Stmt& s);

// False means: not known.
bool can_prove(const Expr& condition, const BoundsMap& bounds = {});

}  // namespace retrograde::simplification
