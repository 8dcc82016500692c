// casters.cpp -- conversions of Python objects to Exprs, Tuples, Ranges and other arguments.
#include "casters.h"

#include "buffer_memory.h"
#include "frontend/data/param.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

template <class T>
const T* as(py::handle object) {
  return py::isinstance<T>(object) ? object.cast<const T*>() : nullptr;
}

bool is_sequence(py::handle object) {
  return PyList_Check(object.ptr()) || PyTuple_Check(object.ptr());
}

}  // namespace

std::optional<Expr> expr_from(py::handle object) {
  if (const auto* expr = as<Expr>(object)) return *expr;
  if (const auto* var = as<Var>(object)) return Expr(*var);
  if (const auto* ref = as<FuncRef>(object)) return Expr(*ref);
  if (const auto* element = as<FuncTupleElementRef>(object)) return Expr(*element);
  if (const auto* var = as<RVar>(object)) return Expr(*var);
  if (const auto* domain = as<RDom>(object)) return Expr(*domain);
  if (const auto* param = as<Param<>>(object)) return Expr(*param);
  if (py::isinstance<py::str>(object)) return Expr(object.cast<std::string>());
  return number_from(object);
}

bool is_tuple_like(py::handle object) {
  if (is_sequence(object)) return true;
  for (const char* name : {"__len__", "__getitem__"}) {
    if (!py::hasattr(object, name)) return false;
  }
  for (const char* name : {"keys", "__array__", "__array_interface__", "__dlpack__"}) {
    if (py::hasattr(object, name)) return false;
  }
  return !PyObject_CheckBuffer(object.ptr()) && !expr_from(object);
}

std::optional<Tuple> tuple_from(py::handle object) {
  if (const auto* ref = as<FuncRef>(object)) return Tuple(*ref);
  if (is_tuple_like(object)) {
    std::vector<Expr> exprs;
    for (py::handle element : py::iter(object)) {
      std::optional<Expr> expr = expr_from(element);
      if (!expr) return {};
      exprs.push_back(std::move(*expr));
    }
    return Tuple(exprs);
  }
  if (std::optional<Expr> expr = expr_from(object)) return Tuple(*expr);
  return {};
}

std::optional<VarOrRVar> loop_from(py::handle object) {
  if (const auto* var = as<Var>(object)) return *var;
  if (const auto* var = as<RVar>(object)) return *var;
  if (const auto* domain = as<RDom>(object)) return *domain;
  return {};
}

py::object object_of(const VarOrRVar& loop) {
  return loop.is_rvar ? py::cast(loop.rvar) : py::cast(loop.var);
}

std::optional<Range> range_from(py::handle object) {
  if (!is_sequence(object) || py::len(object) != 2) return {};
  const auto pair = py::reinterpret_borrow<py::sequence>(object);
  // None: no bound.
  const auto end = [&](size_t i) -> std::optional<Expr> {
    const py::object value = pair[i];
    return value.is_none() ? Expr() : expr_from(value);
  };
  const std::optional<Expr> min = end(0), extent = end(1);
  if (!min || !extent) return {};
  return Range{*min, *extent};
}

std::optional<Func> func_from(py::handle object) {
  if (const auto* image = as<ImageParam>(object)) return Func(*image);
  if (const auto* buffer = as<Buffer<>>(object)) return Func(*buffer);
  return {};
}

std::optional<AdjointInput> adjoint_input_from(py::handle object) {
  if (const auto* func = as<Func>(object)) return AdjointInput(*func);
  if (const auto* image = as<ImageParam>(object)) return AdjointInput(*image);
  if (const auto* param = as<Param<>>(object)) return AdjointInput(*param);
  if (const auto* buffer = as<Buffer<>>(object)) return AdjointInput(*buffer);
  return {};
}

std::optional<Direction> direction_from(py::handle object) {
  if (!is_sequence(object) || py::len(object) != 2) return {};
  const auto pair = py::reinterpret_borrow<py::sequence>(object);
  const py::object first = pair[0], second = pair[1];
  const std::optional<AdjointInput> input = adjoint_input_from(first);
  if (!input) return {};
  if (const auto* func = as<Func>(second)) return Direction(*input, *func);
  if (const auto* buffer = as<Buffer<>>(second)) return Direction(*input, *buffer);
  if (std::optional<Buffer<>> buffer = buffer_from(second)) return Direction(*input, *buffer);
  return {};
}

std::optional<Argument> argument_from(py::handle object) {
  if (const auto* param = as<Param<>>(object)) return Argument(*param);
  if (const auto* image = as<OutputImageParam>(object)) return Argument(*image);
  if (const auto* buffer = as<Buffer<>>(object)) return Argument(*buffer);
  return {};
}

std::vector<Expr> coordinates(py::handle index) {
  std::vector<Expr> result;
  const auto add = [&](py::handle object) {
    if (object.ptr() == Py_Ellipsis) return result.push_back(Var("_"));
    const std::optional<Expr> expr = expr_from(object);
    if (!expr) {
      throw py::type_error("a coordinate is an integer, a Var or another Expr, not " +
                           std::string(py::str(py::type::of(object))));
    }
    result.push_back(*expr);
  };
  if (is_sequence(index)) {
    for (py::handle object : index) add(object);
  } else {
    add(index);
  }
  return result;
}

}  // namespace retrograde::python
