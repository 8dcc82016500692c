// runtime_call.h -- builds calls of runtime functions, which also receive the user context of the compiled function.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "ir/build.h"

namespace retrograde::lower {

inline Expr call_runtime(const char* function, std::vector<Expr> args, Type type = Int(32)) {
  args.insert(args.begin(), Expr(function));
  return call_op(Op::runtime_call, type, std::move(args));
}

// Calls a function that returns an error code, binds the code to `name`, and returns from the pipeline if it is not 0.
inline Stmt checked_call(const std::string& name, Expr call) {
  const Expr code = variable(name);
  return make_let(name, std::move(call), make_assert(code == 0, code));
}

// A pointer to the values, stored one after the other.
inline Expr pack(std::vector<Expr> values) {
  return call_op(Op::pack, Handle(), std::move(values));
}
inline Expr null_handle() { return reinterpret_as(Handle(), make_uint_const(UInt(64), 0)); }

}  // namespace retrograde::lower
