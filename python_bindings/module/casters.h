// casters.h -- conversions of Python arguments: a number or a Var for an Expr, an array for a Buffer, a pair for a
// Range, a dtype for a Type. All bindings include these, so every function accepts the same objects.
//
// A caster tries the class itself first. Conversions are tried only in pybind11's second pass over the overloads. An
// error during a conversion, such as reading an undefined Func, is thrown instead of becoming "incompatible arguments".
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <vector>

#include "autodiff/tangents.h"
#include "frontend/data/buffer.h"
#include "frontend/language/func.h"
#include "frontend/language/var_or_rvar.h"

namespace retrograde::python {

namespace py = pybind11;

// Each returns nullopt if the object does not convert.
std::optional<Expr> expr_from(py::handle object);
std::optional<Tuple> tuple_from(py::handle object);
std::optional<VarOrRVar> loop_from(py::handle object);
std::optional<Range> range_from(py::handle object);
std::optional<Type> type_from(py::handle object);
std::optional<Buffer<>> buffer_from(py::handle object);
std::optional<Func> func_from(py::handle object);
std::optional<AdjointInput> adjoint_input_from(py::handle object);
std::optional<Direction> direction_from(py::handle object);
std::optional<Argument> argument_from(py::handle object);

py::object object_of(const VarOrRVar& loop);

// Operands of one operator. A plain Python number takes the type of the first operand that is an Expr, if it fits. A
// float takes the widest floating-point type among the operands, or float32. NumPy's scalars keep their types.
std::vector<Expr> operands(const std::vector<py::object>& objects);
// The operand that is assigned to an element of type `type`.
Expr operand_for(Type type, py::handle object);
// The operand of a cast: a Python float becomes a float64, so that only the cast rounds it.
std::optional<Expr> unrounded_from(py::handle object);
struct Unrounded {
  Expr expr;
};
// A number as an Expr as wide as `type`, for operators on its bits.
Expr bits_operand(Type type, py::handle object);
// The types of a Func's values; before its definition, those of its declaration.
const std::vector<Type>& value_types(const graph::FuncContents& f);
// A Tuple whose plain numbers take the given types, those of a Func.
Tuple tuple_for(const std::vector<Type>& types, py::handle object);
// Whether it is a Python int or float, whose type depends on the context.
bool is_plain_number(py::handle object);

// Whether it is a tuple, a list, or an object of a user's class with a length and elements, such as a complex number.
// Arrays and dicts are not.
bool is_tuple_like(py::handle object);

// The coordinates in f[x, y]: one or a tuple; `...` is the placeholder _.
std::vector<Expr> coordinates(py::handle index);

}  // namespace retrograde::python

namespace pybind11::detail {

// Loads an object of the class, or the result of `from`.
template <class T, std::optional<T> (*from)(handle)>
class converting_caster : public type_caster_base<T> {
 public:
  bool load(handle source, bool convert) {
    if (type_caster_base<T>::load(source, false)) return true;
    if (!convert || !source || source.is_none()) return false;
    made_ = from(source);
    if (!made_) return false;
    this->value = &*made_;
    return true;
  }

 private:
  std::optional<T> made_;
};

#define RETROGRADE_CONVERTING_CASTER(T, from) \
  template <>                                 \
  class type_caster<T> : public converting_caster<T, &retrograde::python::from> {}
RETROGRADE_CONVERTING_CASTER(retrograde::Expr, expr_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Tuple, tuple_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Range, range_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Type, type_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Buffer<>, buffer_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Func, func_from);
RETROGRADE_CONVERTING_CASTER(retrograde::AdjointInput, adjoint_input_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Direction, direction_from);
RETROGRADE_CONVERTING_CASTER(retrograde::Argument, argument_from);
#undef RETROGRADE_CONVERTING_CASTER

template <>
class type_caster<retrograde::python::Unrounded> {
 public:
  PYBIND11_TYPE_CASTER(retrograde::python::Unrounded, const_name("Expr"));
  bool load(handle source, bool) {
    std::optional<retrograde::Expr> expr = retrograde::python::unrounded_from(source);
    if (!expr) return false;
    value.expr = std::move(*expr);
    return true;
  }
};

// VarOrRVar is not a class in Python; a Var, an RVar or a one-dimensional RDom converts to it.
template <>
class type_caster<retrograde::VarOrRVar> {
 public:
  static constexpr auto name = const_name("VarOrRVar");
  template <class T>
  using cast_op_type = movable_cast_op_type<T>;

  bool load(handle source, bool) {
    value_ = retrograde::python::loop_from(source);
    return value_.has_value();
  }
  static handle cast(const retrograde::VarOrRVar& loop, return_value_policy, handle) {
    return retrograde::python::object_of(loop).release();
  }
  operator retrograde::VarOrRVar*() { return &*value_; }
  operator retrograde::VarOrRVar&() { return *value_; }
  operator retrograde::VarOrRVar&&() && { return std::move(*value_); }

 private:
  std::optional<retrograde::VarOrRVar> value_;
};

}  // namespace pybind11::detail
