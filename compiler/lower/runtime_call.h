// runtime_call.h -- calls of the runtime, which hands each function the context of the call as well.
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

// Calls what gives an error code, under this name, and leaves with the code unless it is 0.
inline Stmt checked_call(const std::string& name, Expr call) {
  const Expr code = variable(name);
  return make_let(name, std::move(call), make_assert(code == 0, code));
}

// The values one after the other in memory.
inline Expr pack(std::vector<Expr> values) {
  return call_op(Op::pack, Handle(), std::move(values));
}
inline Expr null_handle() { return reinterpret_as(Handle(), make_uint_const(UInt(64), 0)); }

}  // namespace retrograde::lower
