// long_functions -- the outermost loops of a long function become functions of their own.
//
//   f: for y { a }; for y { b }   =>   f: f.loop0(&closure0); f.loop1(&closure1)
//
// Some of LLVM's passes take time quadratic in the length of a function: Loop Strength Reduction of the
// gradient of forty steps of a wave equation took four of eight seconds. An outermost loop runs once
// a call of the function, so that another call for it is not felt.
#pragma once

#include "ir/expr.h"

namespace retrograde::codegen {

bool is_long(const Stmt& body);

}  // namespace retrograde::codegen
