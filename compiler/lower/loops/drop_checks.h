// What a target does without: checks at run time, answers to bounds queries.
#pragma once

#include "ir/expr.h"

namespace retrograde::ir {

// Target::NoBoundsQuery: a buffer without memory is an error instead of a question.
Stmt drop_bounds_query(const Stmt& s);
// Target::NoAsserts: every check is left out.
Stmt drop_asserts(const Stmt& s);

}  // namespace retrograde::ir
