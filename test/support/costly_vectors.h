// Counts the operations of vectors that take the most time in loops over the terms of a strided sum.
#pragma once

#include <string>

#include "ir/visit.h"

namespace retrograde {

struct CostlyVectors {
  int loops = 0;  // over terms
  int operations =
      0;  // in them: vectors that divide, take or compare remainders, or put phases together
};

// `terms`: a part of the names of the loops over terms.
inline CostlyVectors costly_vectors(const Stmt& code, const std::string& terms) {
  CostlyVectors found;
  const auto note = [&](const Expr& e) {
    using ir::Kind;
    const bool is_quotient = e.type().is_int() && (e.kind() == Kind::Div || e.kind() == Kind::Mod);
    const bool is_costly = is_quotient || e.kind() == Kind::EQ || e.kind() == Kind::Shuffle;
    found.operations += e.type().lanes() > 1 && is_costly ? 1 : 0;
    return true;
  };
  ir::walk(
      code, [](const Expr&) { return false; },
      [&](const Stmt& part) {
        const auto* loop = part.as<ir::For>();
        if (!loop || loop->name.find(terms) == std::string::npos) return true;
        ++found.loops;
        ir::walk(loop->body, note, [](const Stmt&) { return true; });
        return false;
      });
  return found;
}

}  // namespace retrograde
