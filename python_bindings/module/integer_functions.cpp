// integer_functions.cpp -- binds widening, saturating and rounding integer arithmetic, and updates at several points.
#include "bind_all.h"
#include "binding.h"
#include "frontend/language/integer_ops.h"

namespace retrograde::python {

void bind_integer_functions(py::module_& m) {
  using py::arg;
  using Binary = Expr (*)(const Expr&, const Expr&);
  const auto binary = [&](const char* name, Binary f) {
    def(
        m, name,
        [f](const py::object& a, const py::object& b) {
          const std::vector<Expr> both = operands({a, b});
          return f(both[0], both[1]);
        },
        arg("a"), arg("b"));
  };
  binary("widening_mul", &widening_mul);
  binary("widening_add", &widening_add);
  binary("widening_sub", &widening_sub);
  binary("widening_shift_left", &widening_shift_left);
  binary("widening_shift_right", &widening_shift_right);
  binary("rounding_shift_left", &rounding_shift_left);
  binary("rounding_shift_right", &rounding_shift_right);
  binary("widen_right_add", &widen_right_add);
  binary("widen_right_mul", &widen_right_mul);
  binary("widen_right_sub", &widen_right_sub);
  def(m, "mul_shift_right", &mul_shift_right, arg("a"), arg("b"), arg("q"));
  def(m, "rounding_mul_shift_right", &rounding_mul_shift_right, arg("a"), arg("b"), arg("q"));
  binary("saturating_add", &saturating_add);
  binary("saturating_sub", &saturating_sub);
  binary("halving_add", [](const Expr& a, const Expr& b) { return halving_add(a, b); });
  binary("rounding_halving_add",
         [](const Expr& a, const Expr& b) { return rounding_halving_add(a, b); });
  binary("halving_sub", [](const Expr& a, const Expr& b) { return halving_sub(a, b); });
  def(m, "fast_integer_divide", &fast_integer_divide, arg("numerator"), arg("divisor"));
  def(m, "fast_integer_modulo", &fast_integer_modulo, arg("numerator"), arg("divisor"));
  def(m, "fast_integer_divide_round_to_zero", &fast_integer_divide_round_to_zero, arg("numerator"),
      arg("divisor"));
  def(
      m, "extract_bits",
      [](Type type, const Expr& e, const Expr& lowest) { return extract_bits(type, e, lowest); },
      arg("type"), arg("e"), arg("lowest"));
  def(m, "concat_bits", &concat_bits, arg("parts"));
  def(m, "user_context_value", &user_context_value);
  // Plain numbers take the type of the other points.
  const auto points_of = [](const py::args& points) {
    return operands(points.cast<std::vector<py::object>>());
  };
  def(m, "scatter", [=](const py::args& points) { return scatter(points_of(points)); });
  def(m, "gather", [=](const py::args& points) { return gather(points_of(points)); });
}

}  // namespace retrograde::python
