// expr_functions.cpp -- binds functions of Exprs: selection, arithmetic, functions of real numbers, casts, hints.
#include <algorithm>

#include "autodiff/straight_through.h"
#include "bind_all.h"
#include "binding.h"
#include "frontend/language/expr_ops.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

using py::arg;
using Unary = Expr (*)(Expr);
using Binary = Expr (*)(Expr, Expr);

void unary(py::module_& m, const char* name, Unary f) { def(m, name, f, arg("x")); }

// A binary function; plain numbers take the type of the other operand, see operands().
void binary(py::module_& m, const char* name, Binary f, const char* a, const char* b) {
  def(
      m, name,
      [f](const py::object& x, const py::object& y) {
        const std::vector<Expr> both = operands({x, y});
        return f(both[0], both[1]);
      },
      arg(a), arg(b));
}

std::vector<py::object> objects(const py::args& args) {
  const bool is_list =
      args.size() == 1 && (py::isinstance<py::list>(args[0]) || py::isinstance<py::tuple>(args[0]));
  const py::object all = is_list ? py::object(args[0]) : py::object(args);
  std::vector<py::object> result;
  for (py::handle one : all) result.push_back(py::reinterpret_borrow<py::object>(one));
  return result;
}

// A function of two or more arguments: min(a, b, c).
void folded(py::module_& m, const char* name, Binary f) {
  def(m, name, [f](const py::args& args) {
    std::vector<Expr> all = operands(objects(args));
    if (all.empty()) throw py::type_error("at least one value is needed");
    Expr result = all[0];
    for (size_t i = 1; i < all.size(); i++) result = f(result, all[i]);
    return result;
  });
}

bool is_tuple(const py::object& object) {
  return py::isinstance<Tuple>(object) || py::isinstance<py::tuple>(object) ||
         py::isinstance<py::list>(object) ||
         (py::isinstance<FuncRef>(object) && object.cast<const FuncRef&>().size() > 1);
}

// Tuples of one size; a plain number takes the type of the other Tuples' element at the same place.
std::vector<Tuple> matched_tuples(const std::vector<py::object>& values) {
  const auto is_list = [](const py::object& value) {
    return py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value);
  };
  std::vector<std::vector<Expr>> rows;
  std::vector<std::vector<py::object>> elements;
  for (const py::object& value : values) {
    std::vector<py::object> row;
    if (is_list(value)) {
      for (py::handle one : value) row.push_back(py::reinterpret_borrow<py::object>(one));
    } else {
      const Tuple tuple = value.cast<Tuple>();
      for (const Expr& one : tuple.as_vector()) row.push_back(py::cast(one));
    }
    elements.push_back(std::move(row));
  }
  std::vector<Tuple> result;
  const size_t size = elements[0].size();
  const bool is_one_size =
      std::ranges::all_of(elements, [&](const auto& row) { return row.size() == size; });
  if (!is_one_size) {
    for (const py::object& value : values) result.push_back(value.cast<Tuple>());
    return result;
  }
  rows.resize(values.size());
  for (size_t i = 0; i < size; i++) {
    std::vector<py::object> column;
    for (const auto& row : elements) column.push_back(row[i]);
    const std::vector<Expr> matched = operands(column);
    for (size_t k = 0; k < rows.size(); k++) rows[k].push_back(matched[k]);
  }
  for (const auto& row : rows) result.emplace_back(row);
  return result;
}

// select(c0, v0, c1, v1, ..., otherwise) on Exprs or Tuples.
py::object select_of(const py::args& args) {
  const size_t n = args.size();
  if (n < 3 || n % 2 == 0)
    throw py::type_error("select takes pairs of a condition and a value, and one value last");
  std::vector<py::object> values;
  for (size_t i = 1; i < n; i += 2) values.push_back(args[i]);
  values.push_back(args[n - 1]);
  if (is_tuple(values[0])) {
    const std::vector<Tuple> tuples = matched_tuples(values);
    Tuple result = tuples.back();
    for (size_t i = values.size() - 1; i-- > 0;) {
      const py::object condition = args[2 * i];
      const Tuple& value = tuples[i];
      result = is_tuple(condition) ? select(condition.cast<Tuple>(), value, result)
                                   : select(condition.cast<Expr>(), value, result);
    }
    return py::cast(result);
  }
  const std::vector<Expr> exprs = operands(values);
  Expr result = exprs.back();
  for (size_t i = exprs.size() - 1; i-- > 0;)
    result = select(args[2 * i].cast<Expr>(), exprs[i], result);
  return py::cast(result);
}

void bind_choice(py::module_& m) {
  folded(m, "min", [](Expr a, Expr b) { return min(std::move(a), std::move(b)); });
  folded(m, "max", [](Expr a, Expr b) { return max(std::move(a), std::move(b)); });
  def(m, "select", &select_of);
  def(m, "tuple_select", &select_of);
  def(
      m, "clamp",
      [](const py::object& value, const py::object& low, const py::object& high) {
        const std::vector<Expr> all = operands({value, low, high});
        return clamp(all[0], all[1], all[2]);
      },
      arg("value"), arg("low"), arg("high"));
  def(
      m, "mux",
      [](const Expr& id, const py::object& values) -> Expr {
        if (py::isinstance<Tuple>(values)) return mux(id, values.cast<Tuple>());
        return mux(id, operands(objects(py::make_tuple(values))));
      },
      arg("id"), arg("values"));
  def(
      m, "logical_and", [](const Expr& a, const Expr& b) { return a && b; }, arg("a"), arg("b"));
  def(
      m, "logical_or", [](const Expr& a, const Expr& b) { return a || b; }, arg("a"), arg("b"));
  def(
      m, "logical_not", [](const Expr& a) { return !a; }, arg("a"));
}

void bind_arithmetic(py::module_& m) {
  unary(m, "abs", &abs);
  binary(m, "absd", &absd, "a", "b");
  def(
      m, "lerp",
      [](const py::object& zero, const py::object& one, const py::object& weight) {
        // If both ends are plain numbers, they take the floating-point type of the weight.
        const bool are_numbers = is_plain_number(zero) && is_plain_number(one);
        std::vector<Expr> ends =
            operands(are_numbers && (PyFloat_Check(zero.ptr()) || PyFloat_Check(one.ptr()))
                         ? std::vector{zero, one, weight}
                         : std::vector{zero, one});
        const Expr w = is_plain_number(weight) && ends[0].type().is_float()
                           ? operand_for(ends[0].type(), weight)
                           : weight.cast<Expr>();
        return lerp(ends[0], ends[1], w);
      },
      arg("zero"), arg("one"), arg("weight"));
  def(
      m, "fma",
      [](const py::object& a, const py::object& b, const py::object& c) {
        const std::vector<Expr> all = operands({a, b, c});
        return fma(all[0], all[1], all[2]);
      },
      arg("a"), arg("b"), arg("c"));
  binary(m, "div_round_to_zero", &div_round_to_zero, "a", "b");
  binary(m, "mod_round_to_zero", &mod_round_to_zero, "a", "b");
  unary(m, "popcount", &popcount);
  unary(m, "count_leading_zeros", &count_leading_zeros);
  unary(m, "count_trailing_zeros", &count_trailing_zeros);
}

void bind_reals(py::module_& m) {
#define RETROGRADE_UNARY(name) unary(m, #name, static_cast<Unary>(&name))
  RETROGRADE_UNARY(floor);
  RETROGRADE_UNARY(ceil);
  RETROGRADE_UNARY(round);
  RETROGRADE_UNARY(trunc);
  RETROGRADE_UNARY(fract);
  RETROGRADE_UNARY(sqrt);
  RETROGRADE_UNARY(exp);
  RETROGRADE_UNARY(log);
  RETROGRADE_UNARY(sin);
  RETROGRADE_UNARY(cos);
  RETROGRADE_UNARY(tan);
  RETROGRADE_UNARY(asin);
  RETROGRADE_UNARY(acos);
  RETROGRADE_UNARY(atan);
  RETROGRADE_UNARY(sinh);
  RETROGRADE_UNARY(cosh);
  RETROGRADE_UNARY(tanh);
  RETROGRADE_UNARY(asinh);
  RETROGRADE_UNARY(acosh);
  RETROGRADE_UNARY(atanh);
  RETROGRADE_UNARY(erf);
  RETROGRADE_UNARY(is_nan);
  RETROGRADE_UNARY(is_inf);
  RETROGRADE_UNARY(is_finite);
  RETROGRADE_UNARY(fast_exp);
  RETROGRADE_UNARY(fast_log);
  RETROGRADE_UNARY(fast_sin);
  RETROGRADE_UNARY(fast_cos);
  RETROGRADE_UNARY(fast_inverse);
  RETROGRADE_UNARY(fast_inverse_sqrt);
#undef RETROGRADE_UNARY
  binary(
      m, "pow", [](Expr x, Expr y) { return pow(std::move(x), std::move(y)); }, "x", "y");
  binary(m, "hypot", &hypot, "x", "y");
  binary(m, "atan2", &atan2, "y", "x");
  binary(m, "fast_pow", &fast_pow, "x", "y");
}

void bind_types_of_values(py::module_& m) {
  def(
      m, "cast", [](Type type, const Unrounded& value) { return cast(type, value.expr); },
      arg("type"), arg("value"));
  def(
      m, "saturating_cast",
      [](Type type, const Unrounded& value) { return saturating_cast(type, value.expr); },
      arg("type"), arg("value"));
  def(
      m, "reinterpret",
      [](Type type, const py::object& value) {
        return reinterpret(type, bits_operand(type, value));
      },
      arg("type"), arg("value"));
  const auto concise = [&](const std::string& name, Type type, bool saturates) {
    def(
        m, name.c_str(), [type](const Unrounded& e) { return cast(type, e.expr); }, arg("e"));
    if (saturates)
      def(
          m, (name + "_sat").c_str(),
          [type](const Unrounded& e) { return saturating_cast(type, e.expr); }, arg("e"));
  };
  for (int bits : {8, 16, 32, 64}) {
    concise(text("i", bits), Int(bits), true);
    concise(text("u", bits), UInt(bits), true);
  }
  concise("f16", Float(16), false);
  concise("bf16", BFloat(16), false);
  concise("f32", Float(32), false);
  concise("f64", Float(64), false);
  def(
      m, "undef", [](Type type) { return undef(type); }, arg("type"));
}

void bind_hints(py::module_& m) {
  unary(m, "likely", [](Expr e) { return likely(std::move(e)); });
  unary(m, "likely_if_innermost", &likely_if_innermost);
  unary(m, "strict_float", &strict_float);
  unary(m, "stop_gradient", &stop_gradient);
  binary(
      m, "straight_through",
      [](Expr value, Expr surrogate) { return straight_through(value, surrogate); }, "value",
      "surrogate");
  def(
      m, "unsafe_promise_clamped",
      [](const Expr& value, const py::object& low, const py::object& high) {
        const auto bound = [&](const py::object& end) {
          return end.is_none()     ? Expr()
                 : value.defined() ? operand_for(value.type(), end)
                                   : end.cast<Expr>();
        };
        return unsafe_promise_clamped(value, bound(low), bound(high));
      },
      arg("value"), arg("min") = py::none(), arg("max") = py::none());
  def(
      m, "memoize_tag",
      [](const Expr& value, const py::args& key) {
        return memoize_tag(value, key.cast<std::vector<Expr>>());
      },
      arg("value"));
  const auto random = [&](const char* name, Expr (*f)(Expr)) {
    def(
        m, name, [f](const std::optional<Expr>& seed) { return f(seed.value_or(Expr())); },
        arg("seed") = py::none());
  };
  random("random_float", &random_float);
  random("random_uint", &random_uint);
  random("random_int", &random_int);
}

void bind_effects(py::module_& m) {
  def(m, "print", [](const py::args& values) { return print(values.cast<std::vector<Expr>>()); });
  def(
      m, "print_when",
      [](const Expr& condition, const py::args& values) {
        return print_when(condition, values.cast<std::vector<Expr>>());
      },
      arg("condition"));
  def(
      m, "require",
      [](const Expr& condition, const py::args& values) {
        return require(condition, values.cast<std::vector<Expr>>());
      },
      arg("condition"));
}

}  // namespace

void bind_expr_functions(py::module_& m) {
  bind_choice(m);
  bind_arithmetic(m);
  bind_reals(m);
  bind_types_of_values(m);
  bind_hints(m);
  bind_effects(m);
}

}  // namespace retrograde::python
