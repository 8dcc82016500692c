// resolve_undef -- turn undef into predicates: where undef is chosen, nothing is stored.
//
//   f(r) = select(c, v, undef)     =>   f(r) = v  where c
//
// A value is undefined if any operand is, except for the arm that a select does not choose. UserError if the elements
// of a Tuple are undefined in different places, because a single store writes them all.
#pragma once

#include "lower/program.h"

namespace retrograde::lower {

void resolve_undef(Program& program);

// Whether a value may come from an undef. After resolve_undef only values that are undef as a whole do; they are not
// stored.
bool mentions_undef(const Expr& e);

}  // namespace retrograde::lower
