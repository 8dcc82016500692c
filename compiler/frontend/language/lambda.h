// lambda.h -- anonymous Funcs, as in lambda(x, y, x + y), and evaluation of a single expression.
#pragma once

#include "frontend/language/func.h"

namespace retrograde {

// An anonymous Func of the implicit variables in `e`.
inline Func lambda(const Expr& e) {
  Func f("lambda");
  f(_) = e;
  return f;
}
// An anonymous Func lambda(x, y, ..., e) whose value is the last argument.
template <typename... Rest>
Func lambda(const Var& x, Rest&&... rest) {
  std::vector<Expr> args{x, Expr(std::forward<Rest>(rest))...};
  const Expr value = args.back();
  args.pop_back();
  Func f("lambda");
  f(args) = value;
  return f;
}

namespace frontend {
template <typename T>
void check_evaluates_to(const Expr& e) {
  if (e.defined() && e.type() == type_of<T>()) return;
  user_error("evaluate an expression as " + to_string(type_of<T>()), "it must be of that type",
             e.defined() ? "its type is " + to_string(e.type()) : "it is undefined",
             "Convert it with cast<>()");
}
inline void check_count(size_t values, size_t results) {
  if (values == results) return;
  user_error("evaluate a Tuple", "there is one result for each value",
             text("it has ", values, " values and was given ", results, " results"),
             "Give the address of that many variables");
}
}  // namespace frontend

// Compiles and runs an expression without free variables.
// Requires: it must be of that type.
template <typename T>
T evaluate(const Expr& e) {
  frontend::check_evaluates_to<T>(e);
  Func f;
  f() = e;
  Buffer<T> result = f.realize();
  return result();
}
// Evaluates several expressions: evaluate(Tuple(a, b), &x, &y).
// Requires: there is one result for each value.
template <typename... Results>
requires(sizeof...(Results) >= 1) void evaluate(const Tuple& values, Results*... results) {
  frontend::check_count(values.size(), sizeof...(Results));
  size_t i = 0;
  (frontend::check_evaluates_to<Results>(values[i++]), ...);
  Func f;
  f() = values;
  Realization realization = f.realize();
  i = 0;
  ((*results = realization[i++].template as<Results>()()), ...);
}
// The same as evaluate(); an expression without loops gains nothing from a device.
template <typename T>
T evaluate_may_gpu(const Expr& e) {
  return evaluate<T>(e);
}
template <typename... Results>
requires(sizeof...(Results) >= 1) void evaluate_may_gpu(const Tuple& values, Results*... results) {
  evaluate(values, results...);
}

}  // namespace retrograde
