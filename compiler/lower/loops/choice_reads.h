// choice_reads.h -- the reads of Funcs in an expression, each under the conditions of the choices around it.
//
//   select(p, f(x), g(x))      reads f under p and g under !p
#pragma once

#include <string>

#include "lower/loops/enclosing_conditions.h"

namespace retrograde::lower {

// Calls `read` with the name of the Func, while the conditions are in `enclosing`. The same read may be visited several
// times. Operands that matter whatever is chosen (coordinates, arguments of C functions, operands of promises) are
// visited outside of the choices.
void visit_reads(const Expr& e, EnclosingConditions& enclosing,
                 FunctionRef<void(const std::string&)> read);

}  // namespace retrograde::lower
