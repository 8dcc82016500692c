// resolve_undef -- what undef means, said in predicates: nothing is stored where it is chosen.
//
//   f(r) = select(c, v, undef)     =>   f(r) = v  where c
//   f(r) = {select(c, v, undef), w}  =>   f(r) = {select(c, v, f(r)[0]), w}
//
// A value is undefined where anything that it is computed from is, but for the arm that a select
// does not choose. Elements of a Tuple that are undefined in different places keep their old value
// there; in the pure definition, which has none, they are left as they are.
#pragma once

#include "lower/program.h"

namespace retrograde::ir {

void resolve_undef(Program& program);

}  // namespace retrograde::ir
