// extern_function.h -- calls of scalar C functions inside expressions.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde {

namespace frontend {
// Throws UserError if the types of the arguments differ from the declared ones.
Expr checked_extern_call(const std::string& function, Type result, const std::vector<Type>& types,
                         const std::vector<Expr>& args, bool is_pure = false);
}  // namespace frontend

// Calls the C function R function(Ts...), a symbol of this process or of the JIT externs. The result must
// depend on the arguments alone; vector code calls the function lane by lane.
// Requires: every argument is a defined expression; its arguments have the types that it was
// declared with.
template <typename R, typename... Ts, typename... Args>
Expr call_c_function(const std::string& function, const Args&... args) {
  static_assert(sizeof...(Ts) == sizeof...(Args), "one type for each argument");
  return frontend::checked_extern_call(function, type_of<R>(), {type_of<Ts>()...}, {Expr(args)...});
}

// Calls a C function that has no side effects. A call that does not change in a loop is computed once before
// the loop, if the loop runs at all.
// Requires: every argument is a defined expression; its arguments have the types that it was
// declared with.
template <typename R, typename... Ts, typename... Args>
Expr call_pure_c_function(const std::string& function, const Args&... args) {
  static_assert(sizeof...(Ts) == sizeof...(Args), "one type for each argument");
  return frontend::checked_extern_call(function, type_of<R>(), {type_of<Ts>()...}, {Expr(args)...},
                                       true);
}

}  // namespace retrograde
