// long_functions -- the outermost loops of a long function become separate functions.
//
//   f: for y { a }; for y { b }   =>   f: f.loop0(&closure0); f.loop1(&closure1)
//
// Some LLVM passes take time quadratic in the length of a function: Loop Strength Reduction took four of eight seconds
// for the gradient of forty steps of a wave equation. An outermost loop runs once per call of the function, so the
// additional call does not matter.
#pragma once

#include "ir/expr.h"

namespace retrograde::codegen {

bool is_long(const Stmt& body);

}  // namespace retrograde::codegen
