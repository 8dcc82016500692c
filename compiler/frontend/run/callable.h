// callable.h -- a compiled pipeline as a function. A call passes the arguments in the order that the pipeline was
// compiled for, then the output buffers.
//
//   Callable brighten = f.compile_to_callable({image, gain});
//   brighten(in, 2.0f, out);
//   auto function = brighten.make_std_function<Buffer<uint8_t>, float, Buffer<uint8_t>>();
#pragma once

#include <functional>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/data/buffer.h"
#include "frontend/data/param.h"
#include "frontend/run/jit_handlers.h"

namespace retrograde {

namespace frontend {
// Calls with an argument list that is known at run time only, for other languages.
struct DynamicCall;

// Whether the first argument is a JITUserContext* or a pointer to a derived class.
template <typename... Args>
inline constexpr bool starts_with_context = false;
template <typename First, typename... Rest>
inline constexpr bool starts_with_context<First, Rest...> =
    std::is_convertible_v<First, JITUserContext*>;
}  // namespace frontend

// A compiled pipeline as a function object.
class Callable {
 public:
  Callable() = default;                                  // an undefined function
  bool defined() const { return contents_ != nullptr; }  // whether there is compiled code

  // Runs the pipeline. Arguments are scalars of exactly the parameters' types, and buffers; a JITUserContext*
  // may precede them. Returns 0. An error throws RuntimeError; if an error handler receives it instead, the
  // call returns the error code. Calls may run on several threads at once.
  // Requires: only what was compiled can be called; it takes its arguments, then its output buffers
  // (RuntimeError); what is a buffer must be a buffer, and what is a scalar must be a scalar
  // (RuntimeError); a value must be of type T, its parameter's (RuntimeError); a buffer must have
  // the dimensions that it was compiled for (RuntimeError).
  template <typename... Args>
  int operator()(JITUserContext* context, const Args&... args) const {
    return call(context, {value_of(args)...});
  }
  template <typename... Args>
  requires(!frontend::starts_with_context<Args...>) int operator()(const Args&... args) const {
    return call(nullptr, {value_of(args)...});
  }

  // The Callable as a std::function; argument types are checked here rather than at the first call.
  template <typename... Args>
  std::function<int(Args...)> make_std_function() const {
    std::vector<Value> shapes{shape_of<Args>()...};
    if constexpr (std::is_same_v<First<Args...>, JITUserContext*>) shapes.erase(shapes.begin());
    check(shapes);
    return [self = *this](Args... args) { return self(args...); };
  }

 private:
  friend class Pipeline;
  friend struct frontend::DynamicCall;
  struct Contents;

  template <typename... Args>
  using First = std::tuple_element_t<0, std::tuple<Args..., void>>;

  // An argument, or a description of the arguments that a parameter accepts.
  struct Value {
    halide_buffer_t* buffer = nullptr;
    ir::Scalar scalar;
    bool is_buffer = false;
    Type type;            // bits() == 0: any type
    int dimensions = -1;  // of a buffer; -1: any
  };

  template <typename T, int Dims>
  static Value value_of(const Buffer<T, Dims>& buffer) {
    return value_of(buffer.defined() ? buffer.contents()->buffer.raw_buffer() : nullptr);
  }
  template <typename T, int Dims, int Storage>
  static Value value_of(const Runtime::Buffer<T, Dims, Storage>& buffer) {
    return value_of(const_cast<halide_buffer_t*>(buffer.raw_buffer()));
  }
  static Value value_of(halide_buffer_t* buffer) { return {buffer, {}, true, {}, -1}; }
  template <typename T>
  requires(std::is_arithmetic_v<T> || std::is_pointer_v<T> || SmallFloatType<T>) static Value
      value_of(const T& value) {
    return {nullptr, frontend::to_scalar(value), false, type_of<T>(), -1};
  }

  template <typename T>
  static Value shape_of() {
    using Bare = std::remove_cvref_t<T>;
    if constexpr (std::is_same_v<Bare, halide_buffer_t*>) {
      return value_of(static_cast<halide_buffer_t*>(nullptr));
    } else if constexpr (requires { Bare::has_static_halide_type; }) {
      Value value = value_of(static_cast<halide_buffer_t*>(nullptr));
      if constexpr (Bare::has_static_halide_type) value.type = Type(Bare::static_halide_type());
      if constexpr (Bare::has_static_dimensions) value.dimensions = Bare::static_dimensions();
      return value;
    } else {
      return {nullptr, {}, false, type_of<Bare>(), -1};
    }
  }
  explicit Callable(std::shared_ptr<const Contents> contents) : contents_(std::move(contents)) {}
  // Checks that arguments of these types fit.
  void check(const std::vector<Value>& values) const;
  int call(JITUserContext* context, const std::vector<Value>& values) const;
  void bind(const std::vector<Value>& values, std::vector<void*>& argv,
            std::vector<uint64_t>& scalars) const;
  std::shared_ptr<const Contents> contents_;
};

}  // namespace retrograde
