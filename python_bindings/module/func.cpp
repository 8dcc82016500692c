// func.cpp -- binds the construction, definition and accessors of Func. func_schedule.cpp binds its directives and
// func_running.cpp binds running and compiling.
#include "bind_all.h"
#include "binding.h"
#include "call_site.h"
#include "frontend/data/param.h"
#include "frontend/language/lambda.h"
#include "func_class.h"
#include "ir/print.h"

namespace retrograde::python {

namespace {

// Values converted to the types of earlier definitions: `f[x] = 0` on a float Func stores 0.0.
std::vector<Expr> values_for(const Func& f, const py::sequence& objects) {
  std::vector<Expr> values;
  const std::vector<Type>& types = value_types(*f.function());
  for (size_t i = 0; i < objects.size(); i++) {
    const py::object value = objects[i];
    const bool known = i < types.size();
    values.push_back(known ? operand_for(types[i], value) : py::cast<Expr>(value));
  }
  return values;
}

void assign(const Func& f, const py::object& index, const py::object& value) {
  FuncRef ref(f.function(), coordinates(index));
  if (py::isinstance<Updated>(value)) {
    // Python assigns the result of f[x] += e to f[x]; the update has been added already.
    if (value.cast<Updated>().func == f.function()) return;
    throw py::type_error("what += gave back belongs to another Func");
  }
  if (py::isinstance<FuncRef>(value)) {
    ref = value.cast<const FuncRef&>();
  } else if (py::isinstance<Tuple>(value)) {
    ref = value.cast<const Tuple&>();
  } else if (is_tuple_like(value)) {
    ref = Tuple(values_for(f, py::tuple(py::reinterpret_borrow<py::sequence>(value))));
  } else {
    ref = values_for(f, py::make_tuple(value))[0];
  }
}

Func located(Func f) {
  set_call_site(f);
  return f;
}

void bind_making(FuncClass& c) {
  c.def(py::init([] { return located(Func()); }))
      .def(py::init([](const std::string& name) { return located(Func(name)); }), py::arg("name"))
      .def(py::init([](Type type, int dimensions, const std::string& name) {
             return located(Func(type, dimensions, name));
           }),
           py::arg("required_type"), py::arg("required_dimensions"), py::arg("name") = "")
      .def(py::init([](const std::vector<Type>& types, int dimensions, const std::string& name) {
             return located(Func(types, dimensions, name));
           }),
           py::arg("required_types"), py::arg("required_dimensions"), py::arg("name") = "")
      .def(py::init([](const ImageParam& image) { return Func(image); }), py::arg("image"))
      .def(py::init([](const Buffer<>& buffer) { return located(Func(buffer)); }),
           py::arg("buffer"))
      .def(py::init([](const Expr& e) { return located(Func(e)); }), py::arg("value"))
      .def(
          "__getitem__",
          [](const Func& f, const py::object& index) {
            return FuncRef(f.function(), coordinates(index));
          },
          py::arg("index"))
      .def("__call__",
           [](const Func& f, const py::args& index) {
             return FuncRef(f.function(), coordinates(index));
           })
      .def("__setitem__", &assign, py::arg("index"), py::arg("value"));
}

// An Expr if there is one value, otherwise a Tuple.
py::object value_or_tuple(const Tuple& values) {
  return values.size() == 1 ? py::cast(values[0]) : py::cast(values);
}

void bind_describing(FuncClass& c) {
  c.def("name", &Func::name)
      .def("defined", &Func::defined)
      .def("dimensions", &Func::dimensions)
      .def("args", &Func::args)
      .def("value", [](const Func& f) { return value_or_tuple(f.values()); })
      .def("values", &Func::values)
      .def("output_types", &Func::output_types)
      .def("types", &Func::types)
      .def("type", &Func::type)
      .def("outputs", &Func::outputs)
      .def("has_update_definition", &Func::has_update_definition)
      .def("num_update_definitions", &Func::num_update_definitions)
      .def("update_args", &Func::update_args, py::arg("index") = 0)
      .def(
          "update_value", [](const Func& f, int i) { return value_or_tuple(f.update_values(i)); },
          py::arg("index") = 0)
      .def("update_values", &Func::update_values, py::arg("index") = 0)
      .def("rvars", &Func::rvars, py::arg("index") = 0)
      .def("is_extern", &Func::is_extern)
      .def("extern_function_name", &Func::extern_function_name)
      .def("source_location", &Func::source_location)
      .def("same_as", &Func::same_as, py::arg("other"))
      .def("__hash__", [](const Func& f) { return std::hash<const void*>()(f.function().get()); })
      .def(
          "__eq__", [](const Func& a, const Func& b) { return a.same_as(b); }, py::is_operator())
      .def("__repr__", [](const Func& f) {
        if (!f.defined()) return "<retrograde.Func " + quoted(f.name()) + ", undefined>";
        const auto args = listed(f.args(), [](const Var& v) { return v.name(); });
        const auto types = listed(f.types(), [](Type t) { return to_string(t); });
        const int updates = f.num_update_definitions();
        return "<retrograde.Func " + f.name() + "(" + args + ") of " + types +
               (updates ? text(", ", updates, updates == 1 ? " update>" : " updates>") : ">");
      });
}

// The value as a number, or a tuple of numbers for a Tuple.
py::object evaluated(const Tuple& values) {
  Func f("evaluated");
  f() = values;
  const py::object result = py::cast(f).attr("realize")();
  if (!py::isinstance<py::tuple>(result)) return result[py::tuple()];
  py::list numbers;
  for (py::handle one : result) numbers.append(one[py::tuple()]);
  return py::tuple(numbers);
}

}  // namespace

void bind_func(py::module_& m) {
  FuncClass c(m, "Func", {"LoopDirectives", "Runnable"});
  bind_making(c);
  bind_describing(c);
  // In lambda_(x, y, e) the last argument is the value.
  def(m, "lambda_", [](const py::args& args) {
    if (args.size() == 0) throw py::type_error("the last argument is the value");
    const Expr value = py::cast<Expr>(args[args.size() - 1]);
    if (args.size() == 1) return located(lambda(value));
    Func f("lambda");
    f(coordinates(args[py::slice(0, static_cast<py::ssize_t>(args.size()) - 1, 1)])) = value;
    return located(f);
  });
  def(m, "evaluate", &evaluated, py::arg("value"));
  def(m, "evaluate_may_gpu", &evaluated, py::arg("value"));
}

}  // namespace retrograde::python
