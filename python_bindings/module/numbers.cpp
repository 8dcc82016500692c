// numbers.cpp -- converts Python's and NumPy's numbers, and chooses the types of plain numbers (operands() in
// casters.h).
#include "numbers.h"

#include <algorithm>
#include <cmath>

#include "casters.h"
#include "ir/build.h"

namespace retrograde::python {

namespace {

[[noreturn]] void too_large(py::handle number, const std::string& type) {
  PyErr_SetString(PyExc_OverflowError,
                  (std::string(py::repr(number)) + " does not fit " + type).c_str());
  throw py::error_already_set();
}

bool is_numpy_scalar(py::handle object) {
  return py::hasattr(object, "dtype") && py::hasattr(object, "item") &&
         py::hasattr(object, "shape") && py::len(object.attr("shape")) == 0;
}

// An int of at most 64 bits, signed or unsigned.
struct Integer {
  bool is_negative = false;
  uint64_t bits = 0;  // two's complement
  int64_t as_signed() const { return static_cast<int64_t>(bits); }
  bool fits_signed() const { return is_negative || bits <= static_cast<uint64_t>(INT64_MAX); }
};

Integer integer_of(py::handle object) {
  int overflow = 0;
  const long long value = PyLong_AsLongLongAndOverflow(object.ptr(), &overflow);
  if (overflow == 0) {
    if (value == -1 && PyErr_Occurred()) throw py::error_already_set();
    return {value < 0, static_cast<uint64_t>(value)};
  }
  if (overflow < 0) too_large(object, "64 bits");
  const unsigned long long large = PyLong_AsUnsignedLongLong(object.ptr());
  if (PyErr_Occurred()) {
    PyErr_Clear();
    too_large(object, "64 bits");
  }
  return {false, large};
}

Expr integer_constant(py::handle object) {
  const Integer value = integer_of(object);
  if (!value.fits_signed()) return ir::make_uint_const(UInt(64), value.bits);
  const int64_t number = value.as_signed();
  return ir::make_const(Int(32).can_represent(number) ? Int(32) : Int(64), number);
}

std::optional<Expr> numpy_constant(py::handle object) {
  const std::optional<Type> type = type_from(object.attr("dtype"));
  if (!type) return {};
  return ir::to_expr(scalar_of(*type, object.attr("item")()));
}

bool warns_of_rounding = false;

Expr rounded_constant(py::handle number, Type type) {
  const double value = PyFloat_AS_DOUBLE(number.ptr());
  const bool is_held = !std::isfinite(value) || ir::round_to_type(type, value) == value;
  if (warns_of_rounding && !is_held) {
    const std::string message = std::string(py::repr(number)) + " is rounded to " +
                                to_string(type) + ": f64() keeps its digits";
    if (PyErr_WarnEx(PyExc_RuntimeWarning, message.c_str(), 1) < 0) throw py::error_already_set();
  }
  return ir::make_const(type, value);
}

// A plain number in the type of the other operand; in its own type if it does not fit.
Expr beside(Type type, py::handle number) {
  if (PyFloat_Check(number.ptr())) {
    const double value = PyFloat_AS_DOUBLE(number.ptr());
    if (type.is_float() && (type.can_represent(value) || value != value)) {
      return rounded_constant(number, type.element_of());
    }
    return rounded_constant(number, Float(32));
  }
  const Integer value = integer_of(number);
  const bool fits =
      value.fits_signed() ? type.can_represent(value.as_signed()) : type.can_represent(value.bits);
  if (!fits || type.is_handle() || type.is_bool()) return integer_constant(number);
  if (type.is_float()) {
    return ir::make_const(type.element_of(), value.fits_signed()
                                                 ? static_cast<double>(value.as_signed())
                                                 : static_cast<double>(value.bits));
  }
  if (type.is_uint()) return ir::make_uint_const(type.element_of(), value.bits);
  return ir::make_const(type.element_of(), value.as_signed());
}

// The types that plain ints and plain floats take next to the given operands.
struct Beside {
  std::optional<Type> any, floating;
};

Beside types_of(const std::vector<std::optional<Expr>>& typed) {
  Beside result;
  for (const std::optional<Expr>& e : typed) {
    if (!e || !e->defined()) continue;
    const Type type = e->type();
    if (type.is_bool() || type.is_handle()) continue;  // a condition
    if (!result.any || (type.is_float() && !result.any->is_float())) result.any = type;
    if (type.is_float() && (!result.floating || type.bits() > result.floating->bits())) {
      result.floating = type;
    }
  }
  return result;
}

}  // namespace

bool is_plain_number(py::handle object) {
  if (PyBool_Check(object.ptr())) return false;
  if (PyLong_Check(object.ptr())) return true;
  return PyFloat_Check(object.ptr()) && !is_numpy_scalar(object);  // np.float64 is a float
}

void warn_of_rounding(bool warns) { warns_of_rounding = warns; }

std::optional<Expr> number_from(py::handle object) {
  if (PyBool_Check(object.ptr())) return Expr(object.ptr() == Py_True);
  if (PyLong_Check(object.ptr())) return integer_constant(object);
  if (is_numpy_scalar(object)) return numpy_constant(object);
  if (PyFloat_Check(object.ptr())) {
    return rounded_constant(object, Float(32));
  }
  return {};
}

std::vector<Expr> operands(const std::vector<py::object>& objects) {
  std::vector<std::optional<Expr>> typed;
  for (const py::object& object : objects) {
    if (is_plain_number(object)) {
      typed.emplace_back();
      continue;
    }
    typed.push_back(expr_from(object));
    if (!typed.back()) {
      throw py::type_error(
          "an operand is a number, a Var, a Func at a point or another Expr, not " +
          std::string(py::str(py::type::of(object))));
    }
  }
  const Beside types = types_of(typed);
  std::vector<Expr> result;
  for (size_t i = 0; i < objects.size(); i++) {
    const bool is_float = PyFloat_Check(objects[i].ptr());
    const std::optional<Type>& type = is_float ? types.floating : types.any;
    result.push_back(typed[i] ? *typed[i]
                     : type   ? beside(*type, objects[i])
                              : *number_from(objects[i]));
  }
  return result;
}

Expr operand_for(Type type, py::handle object) {
  if (is_plain_number(object)) return beside(type, object);
  if (const std::optional<Expr> expr = expr_from(object)) return *expr;
  throw py::type_error("a value is a number, a Var, a Func at a point or another Expr, not " +
                       std::string(py::str(py::type::of(object))));
}

std::optional<Expr> unrounded_from(py::handle object) {
  if (is_plain_number(object) && PyFloat_Check(object.ptr()))
    return ir::make_const(Float(64), PyFloat_AS_DOUBLE(object.ptr()));
  return expr_from(object);
}

Expr bits_operand(Type type, py::handle object) {
  if (!is_plain_number(object) || type.bits() < 16) return operand_for(type, object);
  const Type width = PyFloat_Check(object.ptr()) ? Float(type.bits())
                     : type.is_int()             ? type
                                                 : UInt(type.bits());
  return operand_for(width, object);
}

const std::vector<Type>& value_types(const graph::FuncContents& f) {
  return f.types.empty() ? f.required_types : f.types;
}

Tuple tuple_for(const std::vector<Type>& types, py::handle object) {
  const bool is_sequence = PyList_Check(object.ptr()) || PyTuple_Check(object.ptr());
  if (!is_sequence || py::len(object) != types.size()) return object.cast<Tuple>();
  std::vector<Expr> exprs;
  for (py::handle element : object) exprs.push_back(operand_for(types[exprs.size()], element));
  return Tuple(exprs);
}

ir::Scalar scalar_of(Type type, py::handle number) {
  const py::object plain = is_numpy_scalar(number) ? py::object(number.attr("item")())
                                                   : py::reinterpret_borrow<py::object>(number);
  if (type.is_float()) {
    const double value = PyFloat_AsDouble(plain.ptr());
    if (value == -1 && PyErr_Occurred()) throw py::error_already_set();
    return ir::Scalar::of_float(type, value);
  }
  if (PyFloat_Check(plain.ptr())) {
    if (!PyObject_RichCompareBool(plain.ptr(), plain.attr("__floor__")().ptr(), Py_EQ)) {
      throw py::type_error(std::string(py::repr(plain)) + " is not a value of type " +
                           to_string(type));
    }
    return scalar_of(type, plain.attr("__int__")());
  }
  if (!PyLong_Check(plain.ptr())) {
    throw py::type_error("a value of type " + to_string(type) + " is a number, not " +
                         std::string(py::str(py::type::of(plain))));
  }
  const Integer value = integer_of(plain);
  const bool fits =
      value.fits_signed() ? type.can_represent(value.as_signed()) : type.can_represent(value.bits);
  if (!fits) too_large(plain, to_string(type));
  return type.is_uint() ? ir::Scalar::of_uint(type, value.bits)
                        : ir::Scalar::of_int(type, value.as_signed());
}

py::object object_of(const ir::Scalar& value) {
  if (value.type.is_bool()) return py::bool_(value.u != 0);
  if (value.type.is_float()) return py::float_(value.f);
  if (value.type.is_int()) return py::int_(value.i);
  return py::int_(value.u);
}

}  // namespace retrograde::python
