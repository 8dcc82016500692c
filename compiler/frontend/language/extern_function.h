// extern_function.h -- C functions of scalars in expressions.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde {

namespace frontend {
// UserError when the arguments have other types than the function.
Expr checked_extern_call(const std::string& function, Type result, const std::vector<Type>& types,
                         const std::vector<Expr>& args, bool is_pure = false);
}  // namespace frontend

// function(args...), a C function from Ts... to R of this process, or of the JIT externs. It is
// taken to depend on its arguments alone; a vector calls it lane by lane.
// Requires: every argument is a defined expression; its arguments have the types that it was
// declared with.
template <typename R, typename... Ts, typename... Args>
Expr call_c_function(const std::string& function, const Args&... args) {
  static_assert(sizeof...(Ts) == sizeof...(Args), "one type for each argument");
  return frontend::checked_extern_call(function, type_of<R>(), {type_of<Ts>()...}, {Expr(args)...});
}

// The same of a function that does nothing but compute its value: what does not change in a loop is
// computed once, before it, where the loop runs at all.
// Requires: every argument is a defined expression; its arguments have the types that it was
// declared with.
template <typename R, typename... Ts, typename... Args>
Expr call_pure_c_function(const std::string& function, const Args&... args) {
  static_assert(sizeof...(Ts) == sizeof...(Args), "one type for each argument");
  return frontend::checked_extern_call(function, type_of<R>(), {type_of<Ts>()...}, {Expr(args)...},
                                       true);
}

}  // namespace retrograde
