// resolve_undef -- what undef means, said in predicates: nothing is stored where it is chosen.
//
//   f(r) = select(c, v, undef)     =>   f(r) = v  where c
//
// A value is undefined where anything that it is computed from is, but for the arm that a select
// does not choose. UserError when the elements of a Tuple are undefined in different places: one
// store writes them all.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void resolve_undef(Program& program);

// Whether a value may come from an undef: afterwards none does but a whole one, which is not stored.
bool mentions_undef(const Expr& e);

}  // namespace retrograde::lower
