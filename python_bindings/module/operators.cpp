// operators.cpp -- Python's operators for Expr and all classes that convert to it: Var, RVar, RDom, Param, a Func at a
// point. The functions take any objects, are created once, and are added to each class.
#include <functional>

#include "bind_all.h"
#include "binding.h"
#include "frontend/data/param.h"
#include "frontend/language/expr_ops.h"

namespace retrograde::python {

namespace {

using Binary = Expr (*)(Expr, Expr);

py::object not_implemented() { return py::reinterpret_borrow<py::object>(Py_NotImplemented); }

bool is_operand(const py::object& object) {
  return is_plain_number(object) || PyBool_Check(object.ptr()) ||
         (!py::isinstance<py::str>(object) && !py::isinstance<py::tuple>(object) &&
          expr_from(object).has_value());
}

py::object apply(Binary op, const py::object& a, const py::object& b) {
  if (!is_operand(b)) return not_implemented();
  const std::vector<Expr> both = operands({a, b});
  return py::cast(op(both[0], both[1]));
}

bool are_bools(const Expr& a, const Expr& b) {
  return a.defined() && b.defined() && a.type().is_bool() && b.type().is_bool();
}

// & and | on conditions mean && and ||, because Python's `and` and `or` cannot be overloaded.
Expr and_of(Expr a, Expr b) { return are_bools(a, b) ? a && b : a & b; }
Expr or_of(Expr a, Expr b) { return are_bools(a, b) ? a || b : a | b; }
Expr xor_of(Expr a, Expr b) { return are_bools(a, b) ? a != b : a ^ b; }
Expr not_of(const Expr& a) { return a.defined() && a.type().is_bool() ? !a : ~a; }
// Division that rounds down, also for floats.
Expr floor_divided(Expr a, Expr b) {
  const Expr quotient = a / b;
  return quotient.type().is_float() ? floor(quotient) : quotient;
}

struct Named {
  const char* name;      // "__add__"
  const char* reversed;  // "__radd__"; null for comparisons, which Python reverses itself
  Binary op;
};
const Named binary_operators[] = {
    {"__add__", "__radd__", [](Expr a, Expr b) { return a + b; }},
    {"__sub__", "__rsub__", [](Expr a, Expr b) { return a - b; }},
    {"__mul__", "__rmul__", [](Expr a, Expr b) { return a * b; }},
    {"__truediv__", "__rtruediv__", [](Expr a, Expr b) { return a / b; }},
    {"__floordiv__", "__rfloordiv__", &floor_divided},
    {"__mod__", "__rmod__", [](Expr a, Expr b) { return a % b; }},
    {"__pow__", "__rpow__", [](Expr a, Expr b) { return pow(a, b); }},
    {"__and__", "__rand__", &and_of},
    {"__or__", "__ror__", &or_of},
    {"__xor__", "__rxor__", &xor_of},
    {"__lshift__", "__rlshift__", [](Expr a, Expr b) { return a << b; }},
    {"__rshift__", "__rrshift__", [](Expr a, Expr b) { return a >> b; }},
    {"__lt__", nullptr, [](Expr a, Expr b) { return a < b; }},
    {"__le__", nullptr, [](Expr a, Expr b) { return a <= b; }},
    {"__gt__", nullptr, [](Expr a, Expr b) { return a > b; }},
    {"__ge__", nullptr, [](Expr a, Expr b) { return a >= b; }},
    {"__eq__", nullptr, [](Expr a, Expr b) { return a == b; }},
    {"__ne__", nullptr, [](Expr a, Expr b) { return a != b; }},
};

[[noreturn]] bool refuse_bool(const py::object& self) {
  user_error(
      "take an expression as true or false", "its value is known when a pipeline runs, not before",
      "it is " + std::string(py::str(self)),
      "Write select() for a choice, & | ~ for and, or, not, and a.same_as(b) to compare handles");
}

// range(n) and int(n) of a size that is an expression.
[[noreturn]] int refuse_index(const py::object& self) {
  user_error(
      "take an expression as an integer of Python",
      "its value is known when a pipeline runs, not before", "it is " + std::string(py::str(self)),
      "Loop over it with an RDom instead of range(), or define the program for sizes that are "
      "known, which are plain integers");
}

void add_to(py::object cls) {
  const auto method = [&](const char* name, const auto& function) {
    cls.attr(name) = py::cpp_function(function, py::name(name), py::is_method(cls));
  };
  for (const Named& named : binary_operators) {
    const Binary op = named.op;
    method(named.name, [op](const py::object& a, const py::object& b) { return apply(op, a, b); });
    if (!named.reversed) continue;
    method(named.reversed, [op](const py::object& a, const py::object& b) {
      if (!is_operand(b)) return not_implemented();
      return apply(op, b, a);
    });
  }
  method("__neg__", [](const Expr& a) { return -a; });
  method("__pos__", [](const Expr& a) { return a; });
  method("__invert__", &not_of);
  method("logical_not", [](const Expr& a) { return !a; });
  method("__abs__", [](const Expr& a) { return abs(a); });
  method("__bool__", &refuse_bool);
}

}  // namespace

void bind_operators(py::module_& m) {
  for (const char* name :
       {"Expr", "Var", "RVar", "RDom", "Param", "FuncRef", "FuncTupleElementRef"}) {
    const py::object cls = m.attr(name);
    // Setting __eq__ after the class exists does not remove its hash.
    add_to(cls);
  }
  // Sizes are Exprs. Other classes lack it, because objects with __index__ count as integers elsewhere.
  const py::object expr = m.attr("Expr");
  expr.attr("__index__") =
      py::cpp_function(&refuse_index, py::name("__index__"), py::is_method(expr));
}

}  // namespace retrograde::python
