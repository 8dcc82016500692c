// Tests partials at infinite, NaN, denormal, huge and tiny operands against docs/derivatives.md, in float32 and double,
// in the interpreter and as machine code. The expected values are partials in long double by the C library, rounded. At
// infinities and poles they are the column of the table, written out here.
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "autodiff/rules/derivative_rules.h"
#include "gradient/gradient_check.h"
#include "ir/build.h"

namespace retrograde::gradient {
namespace {

using ir::Op;
using Real = long double;
constexpr Real inf = std::numeric_limits<Real>::infinity();
const Real nan = std::numeric_limits<Real>::quiet_NaN();

struct Operands {
  Real x, y, w;
  Real most;      // the largest finite number of the type
  Real quotient;  // x / y, rounded to the type
};
// The partials by x, y and w, as many as the operator has operands.
using Partials = std::function<std::vector<Real>(const Operands&)>;

struct Row {
  std::string name;
  int arity;
  std::function<Expr(const std::vector<Expr>&)> make;
  Partials partials;
  int max_ulp;
  bool poles_of_either_sign = false;
};

Real sign_of(Real v) { return v > 0 ? 1 : v < 0 ? -1 : v == 0 ? 0 : nan; }

Row of(Op op, int max_ulp, Partials partials) {
  return {ir::op_info(op).name, ir::op_info(op).arity,
          [op](std::vector<Expr> a) {
            a.resize(static_cast<size_t>(ir::op_info(op).arity));
            return ir::call_op(op, a[0].type(), a);
          },
          std::move(partials), max_ulp};
}
Row of_x(Op op, int max_ulp, std::function<Real(Real)> partial) {
  return of(op, max_ulp, [partial = std::move(partial)](const Operands& o) {
    return std::vector<Real>{partial(o.x)};
  });
}

Row with_poles_of_either_sign(Row row) {
  row.poles_of_either_sign = true;
  return row;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> all = {
      of_x(Op::abs, 0, [](Real x) { return std::isnan(x) ? 0 : sign_of(x); }),
      of_x(Op::sqrt, 2, [](Real x) { return 0.5L / std::sqrt(x); }),
      of_x(Op::exp, 2, [](Real x) { return std::exp(x); }),
      of_x(Op::log, 2, [](Real x) { return 1 / x; }),
      of_x(Op::sin, 2, [](Real x) { return std::cos(x); }),
      of_x(Op::cos, 2, [](Real x) { return -std::sin(x); }),
      of_x(Op::tan, 4, [](Real x) { return 1 + std::tan(x) * std::tan(x); }),
      of_x(Op::asin, 3, [](Real x) { return 1 / std::sqrt((1 - x) * (1 + x)); }),
      of_x(Op::acos, 3, [](Real x) { return -1 / std::sqrt((1 - x) * (1 + x)); }),
      of_x(Op::atan, 3, [](Real x) { return 1 / (1 + x * x); }),
      of_x(Op::sinh, 2, [](Real x) { return std::cosh(x); }),
      of_x(Op::cosh, 2, [](Real x) { return std::sinh(x); }),
      of_x(Op::tanh, 6, [](Real x) { return 1 / std::cosh(x) / std::cosh(x); }),
      of_x(Op::asinh, 2, [](Real x) { return 1 / std::hypot(x, Real(1)); }),
      of_x(Op::acosh, 4,
           [](Real x) { return x < 1 ? nan : 1 / std::sqrt(x - 1) / std::sqrt(x + 1); }),
      of_x(Op::atanh, 3, [](Real x) { return 1 / (1 - x) / (1 + x); }),
      of_x(Op::erf, 6,
           [](Real x) { return 2 * std::numbers::inv_sqrtpi_v<Real> * std::exp(-x * x); }),
      of(Op::absd, 0,
         [](const Operands& o) {
           Real s = o.x > o.y ? 1 : o.x < o.y ? -1 : 0;
           return std::vector<Real>{s, -s};
         }),
      of(Op::hypot, 3,
         [](const Operands& o) {
           Real h = std::hypot(o.x, o.y);
           if (h == 0) return std::vector<Real>{0, 0};
           if (std::isinf(h)) return std::vector<Real>{nan, nan};
           return std::vector<Real>{o.x / h, o.y / h};
         }),
      of(Op::atan2, 5,
         [](const Operands& o) {
           Real h = std::hypot(o.x, o.y);  // atan2(x, y)
           if (h == 0 || std::isinf(o.x) || std::isinf(o.y)) return std::vector<Real>{0, 0};
           return std::vector<Real>{o.y / h / h, -o.x / h / h};
         }),
      of(Op::strong_div, 3,
         [](const Operands& o) {
           return std::vector<Real>{1 / o.y, o.x == 0 || std::isinf(o.y) ? 0 : -(o.x / o.y) / o.y};
         }),
      of(Op::strong_mul, 0,
         [](const Operands& o) {
           return std::vector<Real>{o.y, o.x};
         }),
      {"saturating_cast", 1,
       [](const std::vector<Expr>& a) {
         return ir::call_op(Op::saturating_cast, Float(16), {a[0]});
       },
       [](const Operands& o) { return std::vector<Real>{std::fabs(o.x) <= 65504 ? 1.L : 0.L}; }, 0},
      of_x(Op::fast_log, 2, [](Real x) { return 1 / x; }),
      with_poles_of_either_sign(
          of(Op::pow, 4,
             [](const Operands& o) {
               const Real v = std::pow(o.x, o.y);
               const bool is_real = o.x >= 0 || std::isinf(o.x) || o.y == std::floor(o.y);
               const bool is_plain = v != 0 && std::isfinite(v) && std::isfinite(o.x);
               Real dx = is_plain ? o.y * v / o.x : o.y * std::pow(o.x, o.y - 1);
               if (!is_real || std::isnan(o.x)) dx = nan;
               if (o.y == 0) dx = 0;
               Real dy = o.x == 0 ? 0 : std::pow(o.x, o.y) * std::log(o.x);
               return std::vector<Real>{dx, dy};
             })),
      of(Op::lerp, 1,
         [](const Operands& o) {
           return std::vector<Real>{1 - o.w, o.w, o.y - o.x};
         }),
      of(Op::fma, 0,
         [](const Operands& o) {
           return std::vector<Real>{o.y, o.x, 1};
         }),
      {"add", 2, [](const std::vector<Expr>& a) { return a[0] + a[1]; },
       [](const Operands&) {
         return std::vector<Real>{1, 1};
       },
       0},
      {"sub", 2, [](const std::vector<Expr>& a) { return a[0] - a[1]; },
       [](const Operands&) {
         return std::vector<Real>{1, -1};
       },
       0},
      {"mul", 2, [](const std::vector<Expr>& a) { return a[0] * a[1]; },
       [](const Operands& o) {
         return std::vector<Real>{o.y, o.x};
       },
       0},
      {"div", 2, [](const std::vector<Expr>& a) { return a[0] / a[1]; },
       [](const Operands& o) {
         return std::vector<Real>{1 / o.y, std::isinf(o.y) ? 0 : -(o.x / o.y / o.y)};
       },
       2},
      {"mod", 2, [](const std::vector<Expr>& a) { return a[0] % a[1]; },
       [](const Operands& o) {
         return std::vector<Real>{1, -std::floor(o.quotient)};
       },
       0},
      {"min", 2, [](const std::vector<Expr>& a) { return min(a[0], a[1]); },
       [](const Operands& o) {
         return std::vector<Real>{o.x < o.y ? 1.L : 0.L, o.x < o.y ? 0.L : 1.L};
       },
       0},
      {"max", 2, [](const std::vector<Expr>& a) { return max(a[0], a[1]); },
       [](const Operands& o) {
         return std::vector<Real>{o.x > o.y ? 1.L : 0.L, o.x > o.y ? 0.L : 1.L};
       },
       0},
  };
  return all;
}

template <typename T>
std::vector<T> extremes(int arity) {
  using limits = std::numeric_limits<T>;
  const T tiny = limits::denorm_min(), normal = limits::min(), most = limits::max(),
          eps = limits::epsilon();
  std::vector<T> positive = {
      0, tiny, normal, std::sqrt(normal), T(1), std::sqrt(most), most, limits::infinity()};
  if (arity == 1) {
    for (T v : {tiny * 1000, normal / 2, std::sqrt(normal) * T(1e-3), T(1e-3), T(0.3), 1 - eps / 2,
                1 + eps, T(2.5), T(9), T(40), T(87), T(89), T(300), T(710), T(1e5), most / 4}) {
      positive.push_back(v);
    }
  } else {
    for (T v : {T(0.3), T(2.5)}) positive.push_back(v);
  }
  std::vector<T> all;
  for (T v : positive) all.push_back(v), all.push_back(-v);
  all.push_back(limits::quiet_NaN());
  return all;
}

// How many numbers of T are between the two, at the type's spacing around `expected`.
template <typename T>
double ulps(T found, Real expected) {
  if (std::isnan(found) || std::isnan(expected))
    return std::isnan(found) && std::isnan(expected) ? 0 : 1e30;
  T rounded = static_cast<T>(expected);
  if (found == rounded) return 0;
  if (std::isinf(found) || std::isinf(rounded)) return 1e30;
  T size = std::max(std::fabs(rounded), std::numeric_limits<T>::min());
  return static_cast<double>(std::fabs(found - expected) / (std::nextafter(size, 2 * size) - size));
}

// The operands of a row, as images with points 0 to count - 1.
template <typename T>
struct Points {
  Buffer<T> x, y, w, ones;
  int count;
  explicit Points(int arity) {
    const std::vector<T> values = extremes<T>(arity);
    const int n = static_cast<int>(values.size());
    count = arity == 1 ? n : n * n;
    x = y = w = ones = Buffer<T>();
    for (Buffer<T>* b : {&x, &y, &w, &ones}) *b = Buffer<T>(count);
    for (int i = 0; i < count; ++i) {
      x(i) = values[static_cast<size_t>(i % n)];
      y(i) = values[static_cast<size_t>(i / n)];
      w(i) = values[static_cast<size_t>((i / 7) % n)];
      ones(i) = 1;
    }
  }
  Operands at(int i) const {
    return {x(i), y(i), w(i), std::numeric_limits<T>::max(), x(i) / y(i)};
  }
};

template <typename T>
void check(const Row& row) {
  Points<T> points(row.arity);
  Var i("i");
  Func f("f"), seed("seed");
  f(i) = row.make({points.x(i), points.y(i), points.w(i)});
  seed(i) = points.ones(i);
  Derivative d = propagate_adjoints(f, seed, {{0, points.count}});
  const Buffer<T> inputs[] = {points.x, points.y, points.w};
  for (int k = 0; k < row.arity; ++k) {
    Func gradient = d(inputs[k]);
    Buffer<T> compiled = gradient.realize({points.count});
    oracle::Array interpreted =
        oracle::Interpreter().realize(gradient.function(), {{0}, {points.count}}).front();
    for (int j = 0; j < points.count; ++j) {
      const Operands o = points.at(j);
      const Real expected = row.partials(o)[static_cast<size_t>(k)];
      const bool is_pole = row.poles_of_either_sign && std::isinf(static_cast<T>(expected));
      if (is_pole && std::isinf(compiled(j))) continue;
      const T in_interpreter = static_cast<T>(interpreted.at({j}).scalar.as_double());
      EXPECT_LE(ulps(compiled(j), expected), row.max_ulp)
          << row.name << ": d"
          << "xyw"[k] << " at " << o.x << ", " << o.y << ", " << o.w
          << " in machine code: " << compiled(j) << " instead of " << expected;
      EXPECT_LE(ulps(in_interpreter, expected), row.max_ulp)
          << row.name << ": d"
          << "xyw"[k] << " at " << o.x << ", " << o.y << ", " << o.w
          << " in the interpreter: " << in_interpreter << " instead of " << expected;
    }
  }
}

// Fast approximations have the partials of the exact function, expressed by their own value.
TEST(ExtremeOperands, EveryOperatorWithPartialsIsListed) {
  std::set<std::string> listed = {"fast_exp", "fast_pow",     "fast_sin",
                                  "fast_cos", "fast_inverse", "fast_inverse_sqrt"};
  for (const Row& row : rows()) listed.insert(row.name);
  for (int i = 0; i < ir::op_count; ++i) {
    const Op op = static_cast<Op>(i);
    if (autodiff::derivative_rule(op).cls != autodiff::RuleClass::Smooth) continue;
    EXPECT_TRUE(listed.contains(ir::op_info(op).name)) << ir::op_info(op).name;
  }
}

TEST(ExtremeOperands, InFloat32) {
  for (const Row& row : rows()) check<float>(row);
}
TEST(ExtremeOperands, InDouble) {
  for (const Row& row : rows()) check<double>(row);
}

}  // namespace
}  // namespace retrograde::gradient
