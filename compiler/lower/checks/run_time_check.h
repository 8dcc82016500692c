// run_time_check.h -- builds checks in generated code that make the call fail.
#pragma once

#include <utility>

#include "ir/build.h"

namespace retrograde::lower {

// Unless the condition holds, the call fails with the code and a message of these parts.
template <class... Parts>
Stmt run_time_check(Expr holds, int code, Parts&&... message) {
  return make_assert(
      std::move(holds),
      call_op(Op::error, Int(32), {Expr(int32_t{code}), Expr(std::forward<Parts>(message))...}));
}

}  // namespace retrograde::lower
