// Simplifies expressions and statements: fewer operations, canonical index arithmetic, decided
// conditions.
//
// Int(32) and Int(64) are assumed not to overflow, as everywhere in the language. The same holds
// for reordered sums of the terms of such an expression, which cannot overflow while the terms stay
// below half of the type's range. Other integer types wrap exactly. Float rewrites keep every bit
// of every result, except that all NaNs are alike. The cost is about linear in the number of nodes
// of the DAG. Names must be unique (ir/validate.h) and stay so.
#pragma once

#include <string>
#include <unordered_map>

#include "ir/interval.h"

namespace retrograde::simplification {

// Ranges of variables. Ends may mention other variables.
using BoundsMap = std::unordered_map<std::string, Interval>;

Expr simplify(const Expr& e, const BoundsMap& bounds = {});

// For statements, simplification also
// - removes dead lets and inlines trivial ones
// - removes loops that never run and branches never taken; replaces loops that run once by their
//   body
// - uses loop bounds, conditions and asserts inside the code that they guard The empty statement is
//   an undefined Stmt.
Stmt simplify(const Stmt& s);

// False means unknown.
bool can_prove(const Expr& condition, const BoundsMap& bounds = {});

}  // namespace retrograde::simplification
