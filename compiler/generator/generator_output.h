// generator_output.h -- Output<T>, a Func that generate() defines and the compiled function computes.
//
//   Output<Buffer<float, 2>> out{"out"};     out(x, y) = ...; or out = some_func;
//   Output<Func> out{"out", {Float(32), UInt(8)}, 2};   a Tuple
//   Output<float> sum{"sum"};                sum() = ...
//   Output<Func[]> levels{"levels", Float(32), 2};      levels.resize(n); levels[0](x, y) = ...
//
// An output is defined, updated and scheduled like any Func.
#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "generator/generator_io.h"

namespace retrograde {
namespace internal {

// The part of Output<T> that does not depend on T.
class GeneratorOutputBase : public GeneratorPort {
 public:
  ~GeneratorOutputBase() override = default;
  // The Funcs, one for each array element.
  virtual std::vector<Func> funcs() const = 0;
  // Creates undefined Funcs for generate() to define.
  virtual void make_funcs() = 0;
  // Checks that generate() defined every Func with the declared types and dimensions.
  // Requires: generate() defines every output.
  void check_defined();

 protected:
  GeneratorOutputBase(Declared declared, IOKind kind, Declared fixed, bool is_array);
  Func make_func(size_t i) const;
  // Declares types and dimensions of the Func of element i. The handle stays the same, so a copy that was
  // taken before generate() refers to the output.
  void declare(const Func& f, size_t i) const;
  void check_assignable(const Func& f) const;
};

template <typename T>
class OutputElements : public GeneratorOutputBase {
 public:
  template <typename... Args>
  requires std::is_constructible_v<Declared, Args...>
  explicit OutputElements(Args&&... args)
      : GeneratorOutputBase(Declared(std::forward<Args>(args)...),
                            ElementTraits<ElementOf<T>>::kind, said_by<T>(), IsArrayIO<T>) {}
  OutputElements(const std::string& name, const std::vector<Type>& types)
      : OutputElements(Declared(name, types)) {}
  OutputElements(const std::string& name, const std::vector<Type>& types, int dims)
      : OutputElements(Declared(name, types, dims)) {}
  OutputElements(size_t size, const std::string& name, const std::vector<Type>& types, int dims)
      : OutputElements(Declared(size, name, types, dims)) {}
};

}  // namespace internal

// A single output, which is a Func.
template <typename T>
class GeneratorOutput : public internal::OutputElements<T>, public Func {
  using Base = internal::OutputElements<T>;
  static constexpr bool is_image = internal::ElementTraits<T>::kind == internal::IOKind::Buffer;

 public:
  using Base::name;  // declared name
  using Base::
      OutputElements;  // declares an output: a name, then types and dimensions that T leaves open
  // Declared types, or those of the definition if the declaration leaves them open.
  std::vector<Type> types() const {
    return asks_func(Base::types_defined()) ? Func::types() : Base::types();
  }
  // Declared type, or that of the definition if the declaration leaves it open.
  Type type() const { return asks_func(Base::types_defined()) ? Func::type() : Base::type(); }
  // Declared number of dimensions, or that of the definition if the declaration leaves it open.
  int dimensions() const {
    return asks_func(Base::dims_defined()) ? Func::dimensions() : Base::dims();
  }
  Func& handle() { return *this; }  // the output as a Func

  // Makes an existing Func the output.
  // Requires: the Func has a definition.
  GeneratorOutput& operator=(const Func& f) {
    Base::check_assignable(f);
    static_cast<Func&>(*this) = f;
    return *this;
  }
  template <typename B, int Dims>
  GeneratorOutput& operator=(const Buffer<B, Dims>& buffer) {
    return *this = Func(buffer);
  }
  GeneratorOutput(const GeneratorOutput&) = delete;
  GeneratorOutput& operator=(const GeneratorOutput& other) {
    return *this = static_cast<const Func&>(other);
  }

  // Bounds and promises of one dimension of the output buffer.
  Dimension dim(int d) const requires is_image { return output_buffer().dim(d); }
  // The output buffer, for promises about it.
  operator OutputImageParam() const requires is_image { return output_buffer(); }
  // Extent of dimension 0 of the output buffer.
  Expr width() const requires is_image { return output_buffer().width(); }
  // Extent of dimension 1 of the output buffer.
  Expr height() const requires is_image { return output_buffer().height(); }
  // Extent of dimension 2 of the output buffer.
  Expr channels() const requires is_image { return output_buffer().channels(); }
  // First coordinate of dimension 0 of the output buffer.
  Expr left() const requires is_image { return output_buffer().left(); }
  // Last coordinate of dimension 0 of the output buffer.
  Expr right() const requires is_image { return output_buffer().right(); }
  // First coordinate of dimension 1 of the output buffer.
  Expr top() const requires is_image { return output_buffer().top(); }
  // Last coordinate of dimension 1 of the output buffer.
  Expr bottom() const requires is_image { return output_buffer().bottom(); }

  // The output as a list of one Func.
  std::vector<Func> funcs() const override { return {*this}; }
  // Creates the undefined Func for generate() to define.
  void make_funcs() override {
    if (!Func::defined()) Base::declare(*this, 0);
  }

 private:
  bool asks_func(bool is_declared) const { return !is_declared && Func::defined(); }
};

// An array of outputs.
template <typename T>
requires internal::IsArrayIO<T>
class GeneratorOutput<T> : public internal::OutputElements<T> {
  using Base = internal::OutputElements<T>;

 public:
  using Base::OutputElements;

  size_t size() const { return Base::array_size(); }  // number of elements
  // Sets the size of an array that was declared without one; call it in generate().
  void resize(size_t size) {
    Base::agree_on_size(size);
    make_funcs();
  }
  // Element i.
  // Requires: elements are counted from 0 to below the array's size.
  Func& operator[](size_t i) {
    Base::check_index(i);
    return funcs_[i];
  }
  const Func& operator[](size_t i) const {
    Base::check_index(i);
    return funcs_[i];
  }
  Func& at(size_t i) { return (*this)[i]; }
  const Func& at(size_t i) const { return (*this)[i]; }
  auto begin() { return funcs_.begin(); }
  auto end() { return funcs_.end(); }
  auto begin() const { return funcs_.begin(); }
  auto end() const { return funcs_.end(); }
  // States a likely range of a dimension of every element, for schedulers.
  GeneratorOutput& set_estimate(const Var& var, const Expr& min, const Expr& extent) {
    for (Func& f : funcs_) f.set_estimate(var, min, extent);
    return *this;
  }
  // States likely ranges of all dimensions of every element, for schedulers.
  GeneratorOutput& set_estimates(const Region& estimates) {
    for (Func& f : funcs_) f.set_estimates(estimates);
    return *this;
  }

  std::vector<Func> funcs() const override { return funcs_; }
  void make_funcs() override {
    if (!Base::array_size_defined()) return;  // resize() will set it
    funcs_.clear();
    for (size_t i = 0; i < size(); i++) funcs_.push_back(Base::make_func(i));
  }

 private:
  std::vector<Func> funcs_;
};

}  // namespace retrograde
