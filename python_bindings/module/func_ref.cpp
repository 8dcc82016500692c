// func_ref.cpp -- binds a Func at a point, which reads as an Expr and is updated by +=, -=, *= and /=.
#include "bind_all.h"
#include "func_class.h"

namespace retrograde::python {

namespace {

Updated done(const graph::FuncPtr& func) { return {func}; }

// The operand of an update; a plain number takes the type of the Func, if that is known.
Expr operand_of(const FuncRef& ref, int value, py::handle object) {
  const std::vector<Type>& types = value_types(*ref.function());
  if (value < static_cast<int>(types.size())) return operand_for(types[value], object);
  return py::reinterpret_borrow<py::object>(object).cast<Expr>();
}

// Applies one of FuncRef's update operators to any kind of right-hand side.
template <class Op>
void bind_update(Class<FuncRef>& c, const char* name, Op op) {
  c.def(
      name,
      [op](FuncRef& ref, const py::object& value) {
        if (py::isinstance<FuncRef>(value)) {
          op(ref, value.cast<const FuncRef&>());
        } else if (py::isinstance<Tuple>(value) || is_tuple_like(value)) {
          op(ref, tuple_for(value_types(*ref.function()), value));
        } else {
          op(ref, operand_of(ref, 0, value));
        }
        return done(ref.function());
      },
      py::arg("value"));
}

template <class Op>
void bind_element_update(Class<FuncTupleElementRef>& c, const char* name, Op op) {
  c.def(
      name,
      [op](FuncTupleElementRef& ref, const py::object& value) {
        op(ref, operand_for(ref.function()->types.at(ref.index()), value));
        return done(ref.function());
      },
      py::arg("value"));
}

void set_element(const FuncRef& ref, int index, const py::object& value) {
  if (py::isinstance<Updated>(value)) return;
  if (index < 0) index += static_cast<int>(ref.size());
  ref[index] = operand_of(ref, index, value);
}

}  // namespace

void bind_func_ref(py::module_& m) {
  py::class_<Updated>(m, "_Updated");

  Class<FuncTupleElementRef> element(m, "FuncTupleElementRef");
  element.def("index", &FuncTupleElementRef::index)
      .def("__hash__", [](const FuncTupleElementRef& e) { return std::hash<const void*>()(&e); })
      .def("__repr__", [](const FuncTupleElementRef& e) {
        return text("<retrograde.FuncTupleElementRef ", e.index(), " of ",
                    quoted(e.function()->name), ">");
      });
  bind_element_update(element, "__iadd__", [](auto& ref, const Expr& v) { ref += v; });
  bind_element_update(element, "__isub__", [](auto& ref, const Expr& v) { ref -= v; });
  bind_element_update(element, "__imul__", [](auto& ref, const Expr& v) { ref *= v; });
  bind_element_update(element, "__itruediv__", [](auto& ref, const Expr& v) { ref /= v; });

  Class<FuncRef> ref(m, "FuncRef");
  ref.def("size", &FuncRef::size)
      .def("__len__", &FuncRef::size)
      .def(
          "__getitem__",
          [](const FuncRef& r, int i) {
            const int size = static_cast<int>(r.size());
            if (i < -size || i >= size)
              throw py::index_error(text("there are ", size, " values, numbered from 0"));
            return r[i < 0 ? size + i : i];
          },
          py::arg("index"))
      .def("__setitem__", &set_element, py::arg("index"), py::arg("value"))
      .def("type", [](const FuncRef& r) { return Expr(r).type(); })
      .def("__hash__", [](const FuncRef& r) { return std::hash<const void*>()(&r); })
      .def("__repr__", [](const FuncRef& r) {
        return "<retrograde.FuncRef to " + quoted(r.function()->name) + ">";
      });
  bind_update(ref, "__iadd__", [](FuncRef& r, const auto& v) { r += v; });
  bind_update(ref, "__isub__", [](FuncRef& r, const auto& v) { r -= v; });
  bind_update(ref, "__imul__", [](FuncRef& r, const auto& v) { r *= v; });
  bind_update(ref, "__itruediv__", [](FuncRef& r, const auto& v) { r /= v; });
}

}  // namespace retrograde::python
