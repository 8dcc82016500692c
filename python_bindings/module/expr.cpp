// expr.cpp -- binds Expr and Tuple. `_terms` shows a scalar expression to Python as nested tuples, so that Python can
// evaluate it over numbers of its own (retrograde/torch/_sizes.py).
#include "bind_all.h"
#include "binding.h"
#include "ir/print.h"

namespace retrograde::python {

namespace {

std::string shown(const Expr& e) { return e.defined() ? ir::print(e) : "undefined"; }

// A number; or the name of an operation and its operands, as a tuple.
py::object terms_of(const Expr& e) {
  using namespace ir;
  if (const auto* n = e.as<IntImm>()) return py::int_(n->value);
  if (const auto* n = e.as<UIntImm>()) return py::int_(n->value);
  if (const auto* n = e.as<FloatImm>()) return py::float_(n->value);
  if (const auto* v = e.as<Variable>()) return py::make_tuple("Variable", v->name);
  if (const auto* c = e.as<Cast>())
    return py::make_tuple("Cast", to_string(c->type), terms_of(c->value));
  if (const auto* b = e.as<Binary>())
    return py::make_tuple(kind_name(e.kind()), terms_of(b->a), terms_of(b->b));
  if (const auto* n = e.as<Not>()) return py::make_tuple("Not", terms_of(n->a));
  if (const auto* s = e.as<Select>()) {
    return py::make_tuple("Select", terms_of(s->condition), terms_of(s->when_true),
                          terms_of(s->when_false));
  }
  const auto* call = e.as<Call>();
  if (!call || call->call_type != CallType::Operator)
    return py::make_tuple("Unknown", ir::print(e));
  if (call->is_marker()) return terms_of(call->args[0]);
  py::list terms;
  terms.append(call->name);
  for (const Expr& arg : call->args) terms.append(terms_of(arg));
  return py::tuple(terms);
}

void bind_tuple(py::module_& m) {
  Class<Tuple>(m, "Tuple")
      .def(py::init([](const py::args& values) {
        // Tuple(a, b) and Tuple([a, b])
        const py::object only = values.size() == 1 ? py::object(values[0]) : py::object(values);
        if (py::isinstance<Tuple>(only)) return only.cast<Tuple>();
        if (std::optional<Tuple> tuple = tuple_from(only)) return *tuple;
        throw py::type_error("the elements of a Tuple are Exprs");
      }))
      .def("size", &Tuple::size)
      .def("as_vector", &Tuple::as_vector)
      .def("__len__", &Tuple::size)
      .def(
          "__getitem__",
          [](const Tuple& t, size_t i) {
            if (i >= t.size()) throw py::index_error("elements are numbered from 0");
            return t[i];
          },
          py::arg("index"))
      .def(
          "__setitem__",
          [](Tuple& t, size_t i, const Expr& value) {
            if (i >= t.size()) throw py::index_error("elements are numbered from 0");
            t[i] = value;
          },
          py::arg("index"), py::arg("value"))
      .def("__repr__", [](const Tuple& t) {
        return "<retrograde.Tuple (" + listed(t.as_vector(), shown) + ")>";
      });
}

}  // namespace

void bind_expr(py::module_& m) {
  Class<Expr>(m, "Expr")
      .def(py::init<>())
      .def(py::init([](const Expr& other) { return other; }), py::arg("value"))
      .def("defined", [](const Expr& e) { return e.defined(); })
      .def(
          "same_as", [](const Expr& a, const Expr& b) { return a.same_as(b); }, py::arg("other"))
      .def("type",
           [](const Expr& e) {
             if (!e.defined())
               user_error("take the type of an Expr", "it must be defined", "it is undefined");
             return e.type();
           })
      .def("__hash__", [](const Expr& e) { return std::hash<const void*>()(e.get()); })
      .def("__str__", &shown)
      .def("__repr__", [](const Expr& e) {
        return "<retrograde.Expr " + (e.defined() ? to_string(e.type()) + " " : "") + shown(e) +
               ">";
      });
  m.def("_terms", &terms_of, py::arg("value"));
  bind_tuple(m);
}

}  // namespace retrograde::python
