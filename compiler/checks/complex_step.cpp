#include "checks/complex_step.h"

#include <unordered_map>

#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/local_derivative.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::checks {

namespace {

// Thrown for operators without a complex form; complex_graph catches it.
struct Refused {
  std::string why;
};

struct Complex {
  Expr re, im;  // im is undefined for values that are no floats
};

Expr zero() { return make_const(Float(64), 0.0); }
Expr real_op(Op op, const Expr& x) { return call_op(op, Float(64), {x}); }
Complex real(const Expr& re) { return {re, zero()}; }
Complex chosen(const Expr& condition, const Complex& a, const Complex& b) {
  return {make_select(condition, a.re, b.re), make_select(condition, a.im, b.im)};
}

Complex operator+(const Complex& a, const Complex& b) { return {a.re + b.re, a.im + b.im}; }
Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
Complex operator-(const Complex& a) { return {zero() - a.re, zero() - a.im}; }
Complex operator*(const Complex& a, const Complex& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
Complex operator/(const Complex& a, const Complex& b) {
  Expr size = b.re * b.re + b.im * b.im;
  return {(a.re * b.re + a.im * b.im) / size, (a.im * b.re - a.re * b.im) / size};
}

Expr modulus(const Complex& a) { return call_op(Op::hypot, Float(64), {a.re, a.im}); }
Expr angle(const Complex& a) { return call_op(Op::atan2, Float(64), {a.im, a.re}); }

Complex exponential(const Complex& a) {
  Expr e = real_op(Op::exp, a.re);
  return {e * real_op(Op::cos, a.im), e * real_op(Op::sin, a.im)};
}
Complex logarithm(const Complex& a) { return {real_op(Op::log, modulus(a)), angle(a)}; }
// The square root of a number whose real part is not negative.
Complex square_root(const Complex& a) {
  Expr re = real_op(Op::sqrt, (modulus(a) + a.re) * 0.5);
  return {re, a.im / (re * 2.0)};
}
Expr product_of(Op of_re, Op of_im, const Complex& a) {
  return real_op(of_re, a.re) * real_op(of_im, a.im);
}
Complex sine(const Complex& a) {
  return {product_of(Op::sin, Op::cosh, a), product_of(Op::cos, Op::sinh, a)};
}
Complex cosine(const Complex& a) {
  return {product_of(Op::cos, Op::cosh, a), zero() - product_of(Op::sin, Op::sinh, a)};
}
Complex hyperbolic_sine(const Complex& a) {
  return {product_of(Op::sinh, Op::cos, a), product_of(Op::cosh, Op::sin, a)};
}
Complex hyperbolic_cosine(const Complex& a) {
  return {product_of(Op::cosh, Op::cos, a), product_of(Op::sinh, Op::sin, a)};
}
// a to the power p; the real part of a must not be negative unless p is a real integer.
Complex power(const Complex& a, const Complex& p) {
  if (is_zero(p.im)) {
    Expr size = call_op(Op::pow, Float(64), {modulus(a), p.re}), turn = angle(a) * p.re;
    return {size * real_op(Op::cos, turn), size * real_op(Op::sin, turn)};
  }
  return exponential(p * logarithm(a));
}

class Complexifier {
 public:
  explicit Complexifier(const Func& output) {
    for (const auto& p : parameters_of({output.function()})) {
      if (!p->type.is_float()) continue;
      const std::string name = claim_name(p->name + "_imaginary");
      result_.imaginary[p.get()] = p->is_buffer
                                       ? ImageParam(Float(64), p->dimensions, name).parameter()
                                       : Param<double>(name).parameter();
    }
    for (const FuncPtr& f : topological_order({output.function()})) add(f);
    result_.output = Func(funcs_.at(output.function().get()));
  }
  ComplexGraph take() { return std::move(result_); }

 private:
  // Index of value k of a Func among the values of its complex version.
  static int position(const FuncContents& f, int k) {
    int result = 0;
    for (int i = 0; i < k; ++i) result += f.types[static_cast<size_t>(i)].is_float() ? 2 : 1;
    return result;
  }

  void add(const FuncPtr& f) {
    auto to = make_func(Role::Widened);
    to->name = claim_name(f->name + "_complex");
    to->made->of = f->name;
    funcs_[f.get()] = to;
    const std::vector<Expr> args = variables_of(f->args);
    for (int s = 0; s < f->stage_count(); ++s) {
      Definition d = f->stage(s);
      std::vector<Expr> values;
      for (const Expr& v : d.values) {
        const Complex c = of(v);
        values.push_back(c.re);
        if (c.im.defined()) values.push_back(c.im);
      }
      if (s == 0) {
        define_pure(to, args, values);
      } else {
        Definition real_parts = map_exprs(d, [&](const Expr& e) { return of(e).re; });
        autodiff::append_update(to, real_parts.args, values, real_parts.rvars,
                                real_parts.predicate);
      }
    }
  }

  Complex of(const Expr& root) {
    const Expr e = without_lets(root);
    kept_.push_back(e);  // keeps the addresses in memo_ valid
    for (const Expr& node : autodiff::post_order({e})) {
      if (!memo_.contains(node.get())) memo_.emplace(node.get(), converted(node));
    }
    return memo_.at(e.get());
  }
  Complex operand(const Expr& e) { return memo_.at(e.get()); }

  Complex converted(const Expr& e) {
    const bool is_float = e.type().is_float();
    if (const Call* call = e.as<Call>()) return is_float ? of_call(*call) : real_call(e, *call);
    if (const Variable* v = e.as<Variable>()) return is_float ? of_scalar(e, *v) : Complex{e, {}};
    if (!is_float) return {map_children(e, [&](const Expr& c) { return operand(c).re; }), {}};
    return match(
        e, [&](const FloatImm&) { return real(e); },
        [&](const Cast& c) {
          const Complex from = operand(c.value);
          return from.im.defined() ? from : real(cast_to(Float(64), from.re));
        },
        [&](const Select& s) {
          return chosen(operand(s.condition).re, operand(s.when_true), operand(s.when_false));
        },
        [&](const Binary& b) { return of_binary(e.kind(), operand(b.a), operand(b.b)); },
        [&](const ExprNode&) -> Complex { refuse("an expression", e); });
  }

  [[noreturn]] static void refuse(const std::string& what, const Expr& e) {
    throw Refused{text("it contains ", what, ", ", e)};
  }

  Complex of_binary(Kind kind, const Complex& a, const Complex& b) {
    switch (kind) {
      case Kind::Add:
        return a + b;
      case Kind::Sub:
        return a - b;
      case Kind::Mul:
        return a * b;
      case Kind::Div:
        return a / b;
      case Kind::Mod: {  // x - y floor(x / y)
        return a - b * real(real_op(Op::floor, a.re / b.re));
      }
      case Kind::Min:
        return chosen(a.re < b.re, a, b);
      case Kind::Max:
        return chosen(a.re > b.re, a, b);
      default:
        break;
    }
    throw Refused{"it contains an operation between floats that has no complex form"};
  }

  Complex of_scalar(const Expr& e, const Variable& v) {
    auto found = result_.imaginary.find(v.symbol.raw());
    if (found == result_.imaginary.end()) return real(e);
    return {e, variable(found->second->name, Float(64), SymbolRef(found->second))};
  }

  std::vector<Expr> real_args(const Call& c) {
    return ir::mapped(c.args, [&](const Expr& a) { return operand(a).re; });
  }
  Complex read(const Call& c) {
    const FuncPtr from = func_of(c);
    const FuncPtr& to = funcs_.at(c.symbol.raw());
    const int at = position(*from, c.component);
    auto part = [&](int k) {
      return call_func(to->name, c.type, real_args(c), at + k, SymbolRef(to));
    };
    if (!c.type.is_float()) return {part(0), {}};
    return {part(0), part(1)};
  }
  // A call whose result is an integer or a condition.
  Complex real_call(const Expr& e, const Call& c) {
    if (c.call_type == CallType::Func) return read(c);
    return {map_children(e, [&](const Expr& child) { return operand(child).re; }), {}};
  }

  Complex of_call(const Call& c) {
    switch (c.call_type) {
      case CallType::Func:
        return read(c);
      case CallType::Image: {
        Expr re = call_image(c.name, c.type, real_args(c), c.symbol);
        auto found = result_.imaginary.find(c.symbol.raw());
        if (found == result_.imaginary.end()) return real(re);
        return {re,
                call_image(found->second->name, Float(64), real_args(c), SymbolRef(found->second))};
      }
      case CallType::Operator:
        return of_operator(c);
      case CallType::Extern:
        break;
    }
    throw Refused{"it calls the C function " + retrograde::quoted(c.name)};
  }

  Complex of_operator(const Call& c) {
    const std::vector<Complex> x = ir::mapped(c.args, [&](const Expr& a) { return operand(a); });
    switch (c.op) {
      case Op::exp:
        return exponential(x[0]);
      case Op::log:
        return logarithm(x[0]);
      case Op::sqrt:
        return square_root(x[0]);
      case Op::pow:
        return power(x[0], x[1]);
      case Op::sin:
        return sine(x[0]);
      case Op::cos:
        return cosine(x[0]);
      case Op::tan:
        return sine(x[0]) / cosine(x[0]);
      case Op::sinh:
        return hyperbolic_sine(x[0]);
      case Op::cosh:
        return hyperbolic_cosine(x[0]);
      case Op::tanh:
        return hyperbolic_sine(x[0]) / hyperbolic_cosine(x[0]);
      case Op::hypot:
        return square_root(x[0] * x[0] + x[1] * x[1]);
      case Op::abs:
        return chosen(x[0].re < zero(), -x[0], x[0]);
      case Op::absd:
        return chosen(x[0].re < x[1].re, x[1] - x[0], x[0] - x[1]);
      case Op::lerp:
        if (!x[2].im.defined()) break;
        return x[0] + (x[1] - x[0]) * x[2];
      case Op::fma:
        return x[0] * x[1] + x[2];
      case Op::strong_mul:
        return chosen(x[0].re == zero() && x[0].im == zero(), real(zero()), x[0] * x[1]);
      case Op::strong_div:
        return chosen(x[0].re == zero() && x[0].im == zero(), real(zero()), x[0] / x[1]);
      case Op::floor:
      case Op::ceil:
      case Op::round:
      case Op::trunc:
      case Op::random:
        return real(call_op(c.op, c.type, real_args(c)));
      case Op::undef:
        return {call_op(c.op, c.type, {}), call_op(c.op, c.type, {})};
      case Op::likely:
      case Op::likely_if_innermost:
      case Op::strict_float:
      case Op::stop_gradient:  // ignored, as finite differences ignore it
        return x[0];
      default:
        break;
    }
    throw Refused{text("it contains \"", op_info(c.op).name,
                       "\", which has no complex form that is exact for tiny imaginary parts")};
  }

  ComplexGraph result_;
  std::map<const Symbol*, FuncPtr> funcs_;
  std::vector<Expr> kept_;
  std::unordered_map<const ExprNode*, Complex> memo_;
};

}  // namespace

ComplexGraph complex_graph(const Func& output) {
  try {
    return Complexifier(output).take();
  } catch (const Refused& refused) {
    ComplexGraph result;
    result.refused = refused.why;
    return result;
  }
}

}  // namespace retrograde::checks
