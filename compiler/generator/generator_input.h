// generator_input.h -- Input<T>, an argument of the function that a generator compiles.
//
//   Input<Buffer<float, 2>> in{"in"};       an image, used like an ImageParam
//   Input<Func> f{"f", Float(32), 2};       an image ahead of time; any Func from C++
//   Input<float> gain{"gain", 1.0f, 0, 10}; a scalar with default and limits
//   Input<Expr> e{"e"};                     a scalar whose type configure() sets
//   Input<Buffer<float>[]> many{"many", 2}; an array of images, sized by many.size=3
#pragma once

#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "generator/generator_io.h"

namespace retrograde {
namespace internal {

// One element of an input: a parameter of the compiled function, or a value from C++.
struct InputValue {
  IOKind kind = IOKind::Scalar;
  std::shared_ptr<graph::ParameterContents> parameter;  // null for a Func or Expr from C++
  Func func;                                            // if it is a Func
  Expr expr;                                            // if it is a scalar

  static InputValue of_func(const Func& f);
  static InputValue of_expr(const Expr& e);
  static InputValue of_image(std::shared_ptr<graph::ParameterContents> image);
  std::vector<Type> types() const;
  int dims() const;
};

// The part of Input<T> that does not depend on T.
class GeneratorInputBase : public GeneratorPort {
 public:
  ~GeneratorInputBase() override = default;
  const std::vector<InputValue>& values() const { return values_; }  // one for each array element
  // Creates parameters of the compiled function. Throws CompileError if types, dimensions or array size are
  // still unknown.
  virtual void make_parameters();
  // Binds values from C++.
  // Requires: the value matches the declaration of the input.
  void set_values(std::vector<InputValue> values);
  // A parameter as a value of this input.
  InputValue value_of(const std::shared_ptr<graph::ParameterContents>& parameter) const;

 protected:
  GeneratorInputBase(Declared declared, IOKind kind, Declared fixed, bool is_array);
  virtual void values_changed() = 0;
  // Sets default, limits and estimate of a scalar's parameter.
  virtual void describe(graph::ParameterContents&) const {}
  void check_ready() const;  // CompileError before generate()
  // Sets the estimate of the dimension that the Func of the image or Func calls `var`.
  void set_estimate_of(const Var& var, const Expr& min, const Expr& extent) const;

 private:
  std::vector<InputValue> values_;
};

template <typename T>
class InputElements : public GeneratorInputBase {
 protected:
  using Traits = ElementTraits<ElementOf<T>>;
  using Handle = typename Traits::Handle;
  explicit InputElements(Declared declared)
      : GeneratorInputBase(std::move(declared), Traits::kind, said_by<T>(), IsArrayIO<T>) {}
  void values_changed() override {
    handles_.clear();
    for (const InputValue& value : values()) {
      if constexpr (std::is_same_v<Handle, ImageParam>)
        handles_.push_back(ImageParam(value.parameter));
      else if constexpr (std::is_same_v<Handle, Func>)
        handles_.push_back(value.func);
      else
        handles_.push_back(value.expr);
    }
  }
  const std::vector<Handle>& handles() const {
    check_ready();
    return handles_;
  }
  void set_estimate_of(size_t i, const Expr& value) {
    check_ready();
    check_index(i);
    if (const auto& p = values()[i].parameter)
      frontend::set_limit(*p, &graph::ParameterContents::estimate, value);
  }

 private:
  std::vector<Handle> handles_;
};

// Adds default value and limits for scalars.
template <typename T>
class ScalarElements : public InputElements<T> {
 protected:
  using E = ElementOf<T>;
  using Value = std::conditional_t<std::is_same_v<E, Expr>, int, E>;
  explicit ScalarElements(Declared declared) : InputElements<T>(std::move(declared)) {}
  ScalarElements(Declared declared, const Value& value)
      : InputElements<T>(std::move(declared)), default_(value), has_default_(true) {}
  ScalarElements(Declared declared, const Value& value, const Value& min, const Value& max)
      : ScalarElements(std::move(declared), value) {
    min_ = min;
    max_ = max;
    has_limits_ = true;
  }
  void describe(graph::ParameterContents& parameter) const override {
    if (has_default_) frontend::set_scalar(parameter, frontend::to_scalar(default_));
    if constexpr (std::is_arithmetic_v<Value>) {
      if (!has_limits_) return;
      frontend::set_limit(parameter, &graph::ParameterContents::min_value, Expr(min_));
      frontend::set_limit(parameter, &graph::ParameterContents::max_value, Expr(max_));
    }
  }

 private:
  Value default_ = {}, min_ = {}, max_ = {};
  bool has_default_ = false, has_limits_ = false;
};

}  // namespace internal

// A single image or Func, which derives from ImageParam or Func.
template <typename T>
class GeneratorInput : public internal::InputElements<T>,
                       public internal::ElementTraits<T>::Handle {
  using Base = internal::InputElements<T>;
  using GeneratorInputBase = internal::GeneratorInputBase;
  using Handle = typename internal::ElementTraits<T>::Handle;

 public:
  // Declares an input: a name, then types and dimensions that T leaves open.
  template <typename... Args>
  requires std::is_constructible_v<internal::Declared, Args...>
  explicit GeneratorInput(Args&&... args) : Base(internal::Declared(std::forward<Args>(args)...)) {}
  using Base::name;                                // declared name
  using Base::type;                                // type of the elements
  using Base::types;                               // types of a Tuple
  int dimensions() const { return Base::dims(); }  // number of dimensions
  Handle& handle() { return *this; }               // the input as an ImageParam or Func

  // States a likely range of a dimension, for schedulers. `var` is one of _0, _1, ... or an argument of the
  // Func.
  // Requires: inputs have values in generate() and schedule(); a dimension has the name of one of the input's
  // arguments.
  GeneratorInput& set_estimate(const Var& var, const Expr& min, const Expr& extent) {
    Base::check_ready();
    GeneratorInputBase::set_estimate_of(var, min, extent);
    return *this;
  }
  // States likely ranges of all dimensions, for schedulers.
  GeneratorInput& set_estimates(const Region& estimates) {
    Base::check_ready();
    if (const auto& image = Base::values().at(0).parameter) {
      ImageParam(image).set_estimates(estimates);
    }
    return *this;
  }
  // Passes the input to an extern stage, as its buffer if it has one.
  operator ExternFuncArgument() const requires std::is_same_v<Handle, Func> {
    Base::check_ready();
    const auto& image = Base::values().at(0).parameter;
    return image ? ExternFuncArgument(ImageParam(image))
                 : ExternFuncArgument(Func(Base::values().at(0).func));
  }

 protected:
  void values_changed() override {
    Base::values_changed();
    static_cast<Handle&>(*this) = Base::handles()[0];
  }
};

// A single scalar, which converts to Expr.
template <typename T>
requires(internal::IsScalarIO<T> && !internal::IsArrayIO<T>) class GeneratorInput<T>
    : public internal::ScalarElements<T> {
  using Base = internal::ScalarElements<T>;
  using Value = typename Base::Value;
  using Declared = internal::Declared;

 public:
  explicit GeneratorInput(const std::string& name) : Base(Declared(name)) {}
  GeneratorInput(const std::string& name, const Value& value) : Base(Declared(name), value) {}
  // An Input<Expr> of this type.
  GeneratorInput(const std::string& name, const Type& type) requires std::is_same_v<T, Expr>
      : Base(Declared(name, type)) {}
  GeneratorInput(const std::string& name, const Value& value, const Value& min, const Value& max)
      : Base(Declared(name), value, min, max) {}
  operator Expr() const { return Base::handles()[0]; }  // the value
  // Passes the value to an extern stage.
  operator ExternFuncArgument() const { return ExternFuncArgument(Base::handles()[0]); }
  // States a likely value, for schedulers.
  void set_estimate(const Expr& value) { Base::set_estimate_of(0, value); }
};

// An array of inputs.
template <typename T>
requires internal::IsArrayIO<T>
class GeneratorInput<T>
    : public std::conditional_t<internal::IsScalarIO<T>, internal::ScalarElements<T>,
                                internal::InputElements<T>> {
  using Base = std::conditional_t<internal::IsScalarIO<T>, internal::ScalarElements<T>,
                                  internal::InputElements<T>>;
  using Declared = internal::Declared;
  static constexpr bool is_scalar = internal::IsScalarIO<T>;

 public:
  explicit GeneratorInput(const std::string& name) : Base(Declared(name)) {}
  GeneratorInput(size_t size, const std::string& name) : Base(Declared(size, name)) {}
  template <typename... Args>
  requires(!is_scalar && sizeof...(Args) >= 2 &&
           std::is_constructible_v<Declared, Args...>) explicit GeneratorInput(Args&&... args)
      : Base(Declared(std::forward<Args>(args)...)) {}
  // Scalars: a default for all, and limits.
  template <typename V>
  requires is_scalar GeneratorInput(const std::string& name, const V& value)
      : Base(Declared(name), value) {}
  template <typename V>
  requires is_scalar GeneratorInput(const std::string& name, const V& value, const V& min,
                                    const V& max)
      : Base(Declared(name), value, min, max) {}
  template <typename V>
  requires is_scalar GeneratorInput(size_t size, const std::string& name, const V& value)
      : Base(Declared(size, name), value) {}
  template <typename V>
  requires is_scalar GeneratorInput(size_t size, const std::string& name, const V& value,
                                    const V& min, const V& max)
      : Base(Declared(size, name), value, min, max) {}

  // Number of elements.
  size_t size() const { return Base::handles().size(); }
  // A handle of element i; directives and promises on it apply to the input.
  auto operator[](size_t i) const {
    const auto& handles = Base::handles();
    this->check_index(i);
    return handles[i];
  }
  auto at(size_t i) const { return (*this)[i]; }
  auto begin() const { return Base::handles().begin(); }
  auto end() const { return Base::handles().end(); }
  void set_estimate(size_t i, const Expr& value) requires is_scalar {
    Base::set_estimate_of(i, value);
  }
};

}  // namespace retrograde
