// types.cpp -- binds Type, and converts NumPy dtypes and names to it.
#include "bind_all.h"
#include "binding.h"
#include "ir/parse.h"
#include "ir/print.h"

namespace retrograde::python {

namespace {

std::optional<Type> type_named(const std::string& name) {
  for (int bits : {8, 16, 32, 64}) {
    for (const Type type : {Int(bits), UInt(bits), Float(bits)}) {
      if (!(type.is_float() && bits == 8) && to_string(type) == name) return type;
    }
  }
  if (name == "bool") return Bool();
  if (name == "bfloat16") return BFloat(16);
  return {};
}

// `value` is a Type or a number.
bool can_represent(const Type& type, const py::object& value) {
  if (py::isinstance<Type>(value)) return type.can_represent(value.cast<Type>());
  if (PyFloat_Check(value.ptr())) return type.can_represent(value.cast<double>());
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &overflow);
  if (overflow < 0) return false;
  if (number == -1 && PyErr_Occurred()) throw py::error_already_set();
  if (overflow == 0) return type.can_represent(static_cast<int64_t>(number));
  const unsigned long long large = PyLong_AsUnsignedLongLong(value.ptr());
  if (PyErr_Occurred()) return PyErr_Clear(), false;
  return type.can_represent(static_cast<uint64_t>(large));
}

// The NumPy dtype of a type's elements.
py::object dtype_of(Type type) {
  const std::string name = type.is_bool() ? "bool" : to_string(type.element_of());
  return py::module_::import("numpy").attr("dtype")(name);
}

void bind_codes(py::module_& m) {
  py::enum_<TypeCode>(m, "TypeCode")
      .value("Int", TypeCode::Int)
      .value("UInt", TypeCode::UInt)
      .value("Float", TypeCode::Float)
      .value("BFloat", TypeCode::BFloat)
      .value("Handle", TypeCode::Handle);
}

Class<Type> bind_type(py::module_& m) {
  Class<Type> type(m, "Type");
  type.attr("Int") = TypeCode::Int;
  type.attr("UInt") = TypeCode::UInt;
  type.attr("Float") = TypeCode::Float;
  type.attr("BFloat") = TypeCode::BFloat;
  type.attr("Handle") = TypeCode::Handle;
  type.def(py::init<>())
      .def(py::init<TypeCode, int, int>(), py::arg("code"), py::arg("bits"), py::arg("lanes") = 1)
      .def(py::init([](const Type& other) { return other; }), py::arg("type"))
      .def("code", &Type::code)
      .def("bits", &Type::bits)
      .def("bytes", &Type::bytes)
      .def("lanes", &Type::lanes)
      .def("is_bool", &Type::is_bool)
      .def("is_int", &Type::is_int)
      .def("is_uint", &Type::is_uint)
      .def("is_int_or_uint", &Type::is_int_or_uint)
      .def("is_float", &Type::is_float)
      .def("is_bfloat", &Type::is_bfloat)
      .def("is_handle", &Type::is_handle)
      .def("is_scalar", &Type::is_scalar)
      .def("is_vector", &Type::is_vector)
      .def("with_lanes", &Type::with_lanes, py::arg("lanes"))
      .def("with_bits", &Type::with_bits, py::arg("bits"))
      .def("with_code", &Type::with_code, py::arg("code"))
      .def("element_of", &Type::element_of)
      .def("widen", &Type::widen)
      .def("narrow", &Type::narrow)
      .def("can_overflow_int", &Type::can_overflow_int)
      .def("can_overflow", &Type::can_overflow)
      .def("same_handle_type", &Type::same_handle_type, py::arg("other"));
  return type;
}

// Values of a type, comparison and text.
void bind_values(Class<Type>& type) {
  type.def("min_int", &Type::min_int)
      .def("max_int", &Type::max_int)
      .def("max_uint", &Type::max_uint)
      .def("can_represent", &can_represent, py::arg("value"))
      .def("is_max", py::overload_cast<uint64_t>(&Type::is_max, py::const_), py::arg("value"))
      .def("is_max", py::overload_cast<int64_t>(&Type::is_max, py::const_), py::arg("value"))
      .def("is_min", py::overload_cast<int64_t>(&Type::is_min, py::const_), py::arg("value"))
      .def("is_min", py::overload_cast<uint64_t>(&Type::is_min, py::const_), py::arg("value"))
      .def("max", &Type::max)
      .def("min", &Type::min)
      .def(
          "__eq__", [](const Type& a, const Type& b) { return a == b; }, py::is_operator())
      .def(
          "__ne__", [](const Type& a, const Type& b) { return !(a == b); }, py::is_operator())
      .def(
          "__lt__", [](const Type& a, const Type& b) { return a < b; }, py::is_operator())
      .def("__hash__", &Type::key)
      .def("__str__", [](const Type& t) { return to_string(t); })
      .def("__repr__", [](const Type& t) { return "<retrograde.Type " + to_string(t) + ">"; })
      .def_property_readonly("dtype", &dtype_of);
}

void bind_makers(py::module_& m) {
  const auto maker = [&](const char* name, Type (*make)(int, int)) {
    def(m, name, make, py::arg("bits"), py::arg("lanes") = 1);
  };
  maker("Int", &Int);
  maker("UInt", &UInt);
  maker("Float", &Float);
  maker("BFloat", &BFloat);
  def(m, "Bool", &Bool, py::arg("lanes") = 1);
  def(m, "Handle", &Handle, py::arg("lanes") = 1);
  def(
      m, "type_of", [](const Type& type) { return type; }, py::arg("type"));
}

}  // namespace

std::optional<Type> type_from(py::handle object) {
  if (py::isinstance<py::str>(object)) return type_named(object.cast<std::string>());
  // numpy.dtype and NumPy's scalar types, if they have a name that is a Type.
  if (py::hasattr(object, "kind") && py::hasattr(object, "name")) {
    if (py::hasattr(object, "isnative") && !object.attr("isnative").cast<bool>()) return {};
    return type_named(py::str(object.attr("name")));
  }
  const bool is_numpy_class =
      PyType_Check(object.ptr()) &&
      (py::hasattr(object, "dtype") || std::string(py::str(object.attr("__module__"))) == "numpy");
  if (is_numpy_class) {
    return type_from(py::module_::import("numpy").attr("dtype")(object));
  }
  if (object.ptr() == reinterpret_cast<PyObject*>(&PyBool_Type)) return Bool();
  return {};
}

void bind_types(py::module_& m) {
  bind_codes(m);
  Class<Type> type = bind_type(m);
  bind_values(type);
  bind_makers(m);
}

}  // namespace retrograde::python
