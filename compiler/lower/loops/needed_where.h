// needed_where.h -- derives from conditions inside of loops the conditions that hold outside of them.
//
//   if (p && x < n) S      S runs only where p holds: outside of the loop over x nothing more is known
//
// Each result is a necessary condition: it may hold too often, never too rarely.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::lower {

// A necessary condition for `condition` to be true (or false, if not `holds`). It consists of expressions that can be
// evaluated anywhere and of reads of Funcs and images. It reads no other memory, has no effects and costs little,
// except for C functions, which are pure.
Expr usable_where(const Expr& condition, bool holds);

// The conjunction and the disjunction of two necessary conditions.
Expr both(const Expr& a, const Expr& b);
Expr either(const Expr& a, const Expr& b);

// A loop or a let around code, innermost last.
struct Binder {
  std::string name;
  Expr value;        // of a let
  Expr min, extent;  // of a loop
};

enum class AtLoops : uint8_t {
  Forget,  // parts that depend on the loop's variable are dropped
  Range,   // parts are relaxed to "for some value in the variable's range"
};

// The condition as seen from outside of the binder.
Expr from_outside(const Expr& condition, const Binder& binder, AtLoops at_loops);

// Without the parts that read Funcs or images for which `may_read` is false.
Expr without_reads(const Expr& condition, FunctionRef<bool(const Call&)> may_read);
// Without the parts that read Funcs or images.
Expr without_reads(const Expr& condition);

// Without the parts that call C functions.
Expr without_calls(const Expr& condition);

// Without the parts that use one of the names.
Expr without_parts_of(const Expr& condition, const std::unordered_set<std::string>& names);

}  // namespace retrograde::lower
