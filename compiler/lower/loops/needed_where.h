// needed_where.h -- conditions under which code runs, as they look from outside of its loops.
//
//   if (p && x < n) S      S runs only where p: all that is known outside of the loop over x
//
// A condition here says "only where": it may be too wide, never too narrow.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"
#include "ir/visit.h"

namespace retrograde::lower {

// What is known where `condition` is true (or false: `holds`), made of what can be evaluated
// anywhere, and of what is read of Funcs and images: no other memory, no effects, and little work but in C functions, which are
// pure.
Expr usable_where(const Expr& condition, bool holds);

// Combine "only where a" and "only where b": `both` hold, or `either` does.
Expr both(const Expr& a, const Expr& b);
Expr either(const Expr& a, const Expr& b);

// A loop or a let around code, innermost last.
struct Binder {
  std::string name;
  Expr value;        // of a let
  Expr min, extent;  // of a loop
};

enum class AtLoops : uint8_t {
  Forget,  // what depends on a loop's variable says nothing outside
  Range,   // it holds for some iteration: by the range of the variable
};

// The condition as it looks from outside of the binder.
Expr from_outside(const Expr& condition, const Binder& binder, AtLoops at_loops);

// Without the parts that read other Funcs and images than those that may be.
Expr without_reads(const Expr& condition, FunctionRef<bool(const Call&)> may_read);

// Without the parts that call C functions.
Expr without_calls(const Expr& condition);

// Without the parts that use one of the names.
Expr without_parts_of(const Expr& condition, const std::unordered_set<std::string>& names);

}  // namespace retrograde::lower
