// generator_io.h -- the common base of a generator's inputs and outputs: name, types, dimensions and array size. The
// declaration may leave types, dimensions and array size open. Then configure(), a generator parameter
// (in.type=float32, in.dim=3, in.size=2) or the value itself determines them.
#pragma once

#include <string>
#include <vector>

#include "frontend/data/param.h"
#include "frontend/language/func.h"
#include "generator/members.h"

namespace retrograde {
namespace internal {

// Kinds of inputs and outputs.
enum class IOKind { Scalar, Function, Buffer };

// An array size or a number of dimensions that is not yet known.
constexpr int any_size = -1;

// The arguments of a declaration: an optional array size, a name, then types, dimensions or both.
struct Declared {
  explicit Declared(std::string name) : name(std::move(name)) {}
  Declared(std::string name, const Type& type) : Declared(std::move(name), std::vector{type}) {}
  Declared(std::string name, std::vector<Type> types)
      : name(std::move(name)), types(std::move(types)) {}
  Declared(std::string name, int dims) : name(std::move(name)), dims(dims) {}
  Declared(std::string name, const Type& type, int dims)
      : Declared(std::move(name), std::vector{type}, dims) {}
  Declared(std::string name, std::vector<Type> types, int dims)
      : name(std::move(name)), types(std::move(types)), dims(dims) {}
  template <typename... Rest>
  requires std::is_constructible_v<Declared, Rest...>
  explicit Declared(size_t array_size, Rest&&... rest) : Declared(std::forward<Rest>(rest)...) {
    size = static_cast<int>(array_size);
  }

  std::string name;
  std::vector<Type> types;
  int dims = any_size;
  int size = any_size;
};

// The common base of inputs and outputs.
class GeneratorPort {
 public:
  virtual ~GeneratorPort() = default;
  GeneratorPort(const GeneratorPort&) = delete;
  GeneratorPort& operator=(const GeneratorPort&) = delete;

  const std::string& name() const { return name_; }  // declared name
  IOKind kind() const { return kind_; }              // scalar, Func or buffer
  bool is_array() const { return is_array_; }        // whether it is an array

  // Whether the types are known: from the declaration, configure(), the caller, or the value.
  // Requires: it is known once it is declared, set or given; they are known once they are declared,
  // set or given; it has one value.
  bool types_defined() const { return !types_.empty(); }
  // Types of the values; several for a Tuple.
  const std::vector<Type>& types() const;
  Type type() const;  // type of the only value
  // Whether the number of dimensions is known.
  bool dims_defined() const { return dims_ != any_size; }
  int dims() const;  // number of dimensions
  // Whether the array size is known.
  bool array_size_defined() const { return array_size_ != any_size; }
  size_t array_size() const;  // number of elements; 1 if it is not an array

  // Sets the type that the declaration leaves open; call it in configure().
  // Requires: configure() is the place for that; its type is declared once; its dimensions are
  // declared once; its size is set once, and not negative.
  void set_type(const Type& type) { set_types({type}); }
  void set_type(const std::vector<Type>& types) { set_types(types); }  // of a Tuple
  // Sets the types of a Tuple that the declaration leaves open; call it in configure().
  void set_types(const std::vector<Type>& types);
  // Sets the number of dimensions that the declaration leaves open; call it in configure().
  void set_dimensions(int dims);
  // Sets the array size that the declaration leaves open; call it in configure().
  void set_array_size(int size);

  // Throws CompileError if the constructor's arguments contradict the C++ type. The constructor does not
  // throw, because generators are also created only to list their names.
  void check_declaration() const;
  std::string role_name() const { return is_output_ ? "output" : "input"; }  // "input" or "output"
  // The name of an array element: "pyramid_2".
  std::string element_name(size_t i) const;
  GeneratorBase* generator() const { return generator_; }  // the generator that it is a member of

 protected:
  // `declared` holds the constructor's arguments, `fixed` the properties that the C++ type fixes. Throws
  // CompileError if they contradict each other.
  GeneratorPort(Declared declared, IOKind kind, Declared fixed, bool is_array, bool is_output);

  [[noreturn]] void refuse(const std::string& asked, const std::string& rule,
                           const std::string& evidence, const std::string& instead) const;
  // Sets open properties; throws CompileError if known ones differ.
  void agree_on(const std::vector<Type>& types, int dims);
  void agree_on_size(size_t size);
  void check_not_generated(const char* asked) const;
  void check_index(size_t i) const;

  void become_array() { is_array_ = true; }

 private:
  friend class GeneratorBase;
  GeneratorBase* generator_ = nullptr;
  std::string name_;
  IOKind kind_;
  std::vector<Type> types_;
  int dims_;
  bool is_array_;
  int array_size_;
  bool is_output_;
  Message contradiction_;
};

// Properties of the T in Input<T> and Output<T>: T[] and T[n] are arrays.
template <typename T>
struct ArrayTraits {
  using Element = T;
  static constexpr bool is_array = false;
  static constexpr int size = 1;
};
template <typename T>
struct ArrayTraits<T[]> {
  using Element = T;
  static constexpr bool is_array = true;
  static constexpr int size = any_size;
};
template <typename T, size_t N>
struct ArrayTraits<T[N]> {
  using Element = T;
  static constexpr bool is_array = true;
  static constexpr int size = static_cast<int>(N);
};
template <typename T>
using ElementOf = typename ArrayTraits<T>::Element;

// Properties of one element; the general case covers arithmetic types and pointers. Handle is the type
// through which a generator uses the element.
template <typename E>
struct ElementTraits {
  using Handle = Expr;
  static constexpr IOKind kind = IOKind::Scalar;
  static constexpr int dims = 0;
  static std::vector<Type> types() { return {type_of<E>()}; }
};
template <>
struct ElementTraits<Expr> {
  using Handle = Expr;
  static constexpr IOKind kind = IOKind::Scalar;
  static constexpr int dims = 0;
  static std::vector<Type> types() { return {}; }
};
template <>
struct ElementTraits<Func> {
  using Handle = Func;
  static constexpr IOKind kind = IOKind::Function;
  static constexpr int dims = any_size;
  static std::vector<Type> types() { return {}; }
};
template <typename T, int Dims>
struct ElementTraits<Buffer<T, Dims>> {
  using Handle = ImageParam;
  static constexpr IOKind kind = IOKind::Buffer;
  static constexpr int dims = Dims;
  static std::vector<Type> types() {
    if constexpr (std::is_void_v<std::remove_const_t<T>>)
      return {};
    else
      return {type_of<std::remove_const_t<T>>()};
  }
};
template <typename T>
Declared said_by() {
  using Traits = ElementTraits<ElementOf<T>>;
  return Declared(static_cast<size_t>(ArrayTraits<T>::size), "", Traits::types(), Traits::dims);
}
template <typename T>
concept IsScalarIO = ElementTraits<ElementOf<T>>::kind == IOKind::Scalar;
template <typename T>
concept IsArrayIO = ArrayTraits<T>::is_array;

}  // namespace internal
}  // namespace retrograde
