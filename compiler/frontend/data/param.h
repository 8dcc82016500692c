// param.h -- scalars that a compiled pipeline takes as arguments.
//
// Param<float> gain("gain", 1.0f, 0.0f, 10.0f); f(x) = gain * in(x); gain.set(2.0f);
// f.realize({n});
#pragma once

#include <memory>
#include <string>
#include <type_traits>

#include "frontend/data/argument.h"
#include "frontend/language/var.h"
#include "graph/function.h"

namespace retrograde {

namespace frontend {
// A new parameter, with a generated name if `name` is empty.
std::shared_ptr<ParameterContents> make_scalar_parameter(Type type, const std::string& name);
// Converts a value to the parameter's type. Throws CompileError if it does not fit.
Scalar converted_scalar(const ParameterContents& parameter, const Scalar& value);
void set_scalar(ParameterContents& parameter, const Scalar& value);
void set_limit(ParameterContents& parameter, Expr ParameterContents::*field, const Expr& value);
Scalar get_scalar(const ParameterContents& parameter, Type type);

template <typename T>
Scalar to_scalar(T value) {
  if constexpr (std::is_same_v<T, float16_t> || std::is_same_v<T, bfloat16_t>) {
    return Scalar::of_float(type_of<T>(), static_cast<double>(value));
  } else if constexpr (std::is_pointer_v<T>) {
    Scalar result;
    result.type = Handle();
    result.u = reinterpret_cast<uintptr_t>(value);
    return result;
  } else if constexpr (std::is_floating_point_v<T>) {
    return Scalar::of_float(type_of<T>(), static_cast<double>(value));
  } else if constexpr (std::is_signed_v<T>) {
    return Scalar::of_int(type_of<T>(), value);
  } else {
    return Scalar::of_uint(type_of<T>(), static_cast<uint64_t>(value));
  }
}
template <typename T>
T from_scalar(const Scalar& value) {
  if constexpr (std::is_same_v<T, float16_t> || std::is_same_v<T, bfloat16_t>) {
    return T(value.f);
  } else if constexpr (std::is_pointer_v<T>) {
    return reinterpret_cast<T>(static_cast<uintptr_t>(value.u));
  } else if constexpr (std::is_floating_point_v<T>) {
    return static_cast<T>(value.f);
  } else if constexpr (std::is_signed_v<T>) {
    return static_cast<T>(value.i);
  } else {
    return static_cast<T>(value.u);
  }
}
}  // namespace frontend

// A scalar that a compiled pipeline takes as an argument, bound with set() before a call. T is its type;
// Param<> (void) takes the type at run time.
template <typename T = void>
class Param {
  struct None;  // the value type of Param<void>: it has constructors without a value only
  using Value = std::conditional_t<std::is_void_v<T>, None*, T>;
  template <typename Other>
  friend class Param;

 public:
  static constexpr bool has_static_type = !std::is_void_v<T>;  // whether T fixes the type
  static Type static_type() { return type_of<T>(); }           // the type that T fixes

  // A parameter without a value, with a generated name unless one is given.
  // Requires: its type is a scalar.
  Param() requires has_static_type : parameter_(frontend::make_scalar_parameter(type_of<T>(), "")) {
  }
  explicit Param(const std::string& name) requires has_static_type
      : parameter_(frontend::make_scalar_parameter(type_of<T>(), name)) {}
  template <frontend::TextPointer Text>
  requires has_static_type explicit Param(const Text& name)
      : Param(frontend::name_from(name, "a Param")) {}
  explicit Param(std::nullptr_t) requires(std::is_pointer_v<T>) = delete;
  explicit Param(Type type, const std::string& name = "") requires(!has_static_type)
      : parameter_(frontend::make_scalar_parameter(type, name)) {}
  Param(Type type, std::nullptr_t) = delete;
  // A handle to an existing parameter.
  explicit Param(std::shared_ptr<graph::ParameterContents> parameter) requires(!has_static_type)
      : parameter_(std::move(parameter)) {}
  // A parameter with an initial value, and optionally limits as in set_range().
  explicit Param(Value value) requires(has_static_type && !std::is_pointer_v<T>) : Param() {
    set(value);
  }
  Param(const std::string& name, Value value) requires has_static_type : Param(name) { set(value); }
  Param(Value value, const Expr& min, const Expr& max) requires has_static_type : Param() {
    set(value);
    set_range(min, max);
  }
  Param(const std::string& name, Value value, const Expr& min,
        const Expr& max) requires has_static_type : Param(name) {
    set(value);
    set_range(min, max);
  }
  // A handle to the same parameter under another static type.
  // Requires: the types must agree.
  template <typename Other>
  Param(const Param<Other>& other) : parameter_(other.parameter_) {
    check_type(other.type());
  }
  Param(const Param&) = default;
  Param& operator=(const Param&) = default;

  // Name in messages and generated code.
  const std::string& name() const { return parameter_->name; }
  Type type() const { return parameter_->type; }  // type of the value
  // The value that set() or the constructor bound.
  // Requires: a value must have been set; the types must agree.
  template <typename V = Value>
  V get() const {
    return frontend::from_scalar<V>(frontend::get_scalar(*parameter_, type_of<V>()));
  }
  // Binds the value that the next calls use.
  // Requires: the value must fit the parameter's type.
  template <typename V>
  void set(const V& value) {
    frontend::set_scalar(*parameter_, frontend::to_scalar(value));
  }
  // Sets both limits. Every call checks its value against them, and the compiler relies on them.
  // Requires: limits are numbers; a limit is a value of the parameter's type; a limit has one value
  // in each call: it is made of parameters and facts about buffers.
  void set_range(const Expr& min, const Expr& max) {
    set_min_value(min);
    set_max_value(max);
  }
  // Sets the lower limit, which calls check and the compiler relies on.
  void set_min_value(const Expr& min) {
    frontend::set_limit(*parameter_, &graph::ParameterContents::min_value, min);
  }
  // Sets the upper limit, which calls check and the compiler relies on.
  void set_max_value(const Expr& max) {
    frontend::set_limit(*parameter_, &graph::ParameterContents::max_value, max);
  }
  // Promises that no call's value is infinite or NaN. Derivatives assume that of every Param anyway.
  void promise_finite() {
    parameter_->is_finite = true;
    parameter_->version++;
  }
  Expr min_value() const { return parameter_->min_value; }  // lower limit, or undefined
  Expr max_value() const { return parameter_->max_value; }  // upper limit, or undefined
  // States a likely value for schedulers; calls may use others.
  template <typename V>
  void set_estimate(const V& value) {
    frontend::set_limit(*parameter_, &graph::ParameterContents::estimate, Expr(value));
  }
  // The value as an Expr.
  operator Expr() const { return ir::variable(name(), type(), ir::SymbolRef(parameter_)); }
  // Describes the parameter as an argument of an ahead-of-time function.
  operator Argument() const { return frontend::argument_of(*parameter_); }
  // The record behind the handle.
  const std::shared_ptr<graph::ParameterContents>& parameter() const { return parameter_; }

 private:
  void check_type(Type other) const {
    if constexpr (has_static_type) {
      if (other == type_of<T>()) return;
      user_error("use the Param " + retrograde::quoted(name()) + " as a Param of " +
                     to_string(type_of<T>()),
                 "the types must agree", "it is of type " + to_string(other),
                 "Use it with its own type");
    }
  }
  std::shared_ptr<graph::ParameterContents> parameter_;
};

}  // namespace retrograde
