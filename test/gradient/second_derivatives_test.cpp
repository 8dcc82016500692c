// Tests second derivatives of every operator, in all four orders of the modes: reverse over forward, forward over
// reverse, twice reverse, twice forward.
//
// At regular points they agree with differences in double. At exceptional points (kinks, ties, poles, ends of the
// domain, infinities) the orders agree with each other and the Hessian is symmetric; `exceptions` lists the cases in
// which they do not, with the reason. An arm that a select does not choose contributes exactly 0.
#include <array>
#include <functional>
#include <map>
#include <set>

#include "autodiff/jacobian.h"
#include "autodiff/rules/derivative_rules.h"
#include "autodiff/second_order.h"
#include "autodiff/tangents.h"
#include "gradient/gradient_check.h"
#include "ir/build.h"
#include "ir/scalar.h"

namespace retrograde::gradient {
namespace {

using ir::Op;
using Point = std::array<double, 3>;
constexpr double inf = std::numeric_limits<double>::infinity();

struct Operation {
  std::string name;
  int arity;
  std::function<Expr(const std::vector<Expr>&)> make;
  std::vector<Point> regular;       // inside the domain, away from kinks
  std::vector<double> exceptional;  // every combination of these
};

std::vector<Point> on_axis(const std::vector<double>& values) {
  std::vector<Point> result;
  for (double v : values) result.push_back({v, 0, 0});
  return result;
}

const std::vector<double> ends{0, -0.0, 1, -1, 0.5, -2, inf, -inf};

Operation of(Op op, std::vector<Point> regular) {
  const int arity = ir::op_info(op).arity;
  return {ir::op_info(op).name, arity,
          [op, arity](std::vector<Expr> a) {
            a.resize(static_cast<size_t>(arity));
            return ir::call_op(op, a[0].type(), a);
          },
          std::move(regular), ends};
}
Operation of_two(const std::string& name, std::function<Expr(const Expr&, const Expr&)> make,
                 std::vector<Point> regular) {
  return {name, 2,
          [make = std::move(make)](const std::vector<Expr>& a) { return make(a[0], a[1]); },
          std::move(regular), ends};
}

const std::vector<Operation>& operations() {
  static const std::vector<Point> pairs{{0.75, 1.5}, {-1.25, 0.5}, {2.5, -0.875}};
  static const std::vector<Operation> all = {
      of(Op::abs, on_axis({0.7, -1.3})),
      of(Op::absd, {{0.7, 1.5}, {2.0, 0.5}}),
      of(Op::lerp, {{0.7, 1.5, 0.3}, {-2.0, 0.5, 0.75}}),
      of(Op::fma, {{0.7, 1.5, 0.3}, {-2.0, 0.5, 0.75}}),
      of(Op::sqrt, on_axis({0.4, 9})),
      of(Op::exp, on_axis({-1.2, 2})),
      of(Op::log, on_axis({0.4, 7})),
      of(Op::pow, {{1.7, 2.3}, {0.6, -1.2}, {2, 0}, {0.5, 0}, {3, 1}, {1, 2}}),
      of(Op::hypot, {{3, -4}, {0.5, 0}, {0, -2}}),
      of(Op::sin, on_axis({0.9, 0})),
      of(Op::cos, on_axis({0.9, 0})),
      of(Op::tan, on_axis({0.9, 0})),
      of(Op::asin, on_axis({0.6, 0, -0.9})),
      of(Op::acos, on_axis({0.6, 0, -0.9})),
      of(Op::atan, on_axis({1.6, 0})),
      of(Op::atan2, {{1.6, -0.7}, {-0.25, 0}, {0, 0.5}, {1, 1}}),
      of(Op::sinh, on_axis({1.1, 0})),
      of(Op::cosh, on_axis({-1.1, 0})),
      of(Op::tanh, on_axis({0.8, -2.5, 0})),
      of(Op::asinh, on_axis({2.2, 0})),
      of(Op::acosh, on_axis({1.9})),
      of(Op::atanh, on_axis({0.55, 0})),
      of(Op::erf, on_axis({0.4, -1.5, 0})),
      of(Op::fast_exp, on_axis({0.3})),
      of(Op::fast_log, on_axis({1.4})),
      of(Op::fast_pow, {{1.4, 1.5}, {2, 0}}),
      of(Op::fast_sin, on_axis({0.8})),
      of(Op::fast_cos, on_axis({0.8})),
      of(Op::fast_inverse, on_axis({1.7, -0.4})),
      of(Op::fast_inverse_sqrt, on_axis({1.7})),
      of(Op::saturating_cast, on_axis({1.7})),
      of(Op::strong_div, {{1.7, 0.4}, {-0.5, 2}}),
      of(Op::strong_mul, {{1.7, 0.4}, {0, 2}}),
      of_two(
          "add", [](const Expr& a, const Expr& b) { return a + b; }, pairs),
      of_two(
          "sub", [](const Expr& a, const Expr& b) { return a - b; }, pairs),
      of_two(
          "mul", [](const Expr& a, const Expr& b) { return a * b; }, pairs),
      of_two(
          "div", [](const Expr& a, const Expr& b) { return a / b; }, pairs),
      of_two("mod", [](const Expr& a, const Expr& b) { return a % b; }, {{7.3, 2.1}, {-1.3, 0.8}}),
      of_two(
          "min", [](const Expr& a, const Expr& b) { return min(a, b); }, pairs),
      of_two(
          "max", [](const Expr& a, const Expr& b) { return max(a, b); }, pairs),
      of_two(
          "select", [](const Expr& a, const Expr& b) { return select(a > b, a * a, a * b * b); },
          pairs),
  };
  return all;
}

TEST(SecondDerivatives, EveryOperatorWithPartialsIsListed) {
  std::set<std::string> listed;
  for (const Operation& o : operations()) listed.insert(o.name);
  for (int i = 0; i < ir::op_count; ++i) {
    const Op op = static_cast<Op>(i);
    if (autodiff::derivative_rule(op).cls != autodiff::RuleClass::Smooth) continue;
    EXPECT_TRUE(listed.contains(ir::op_info(op).name)) << ir::op_info(op).name;
  }
}

// The reason why orders of the modes, or of the operands, differ at exceptional points.
struct Exception {
  std::string operation;
  std::function<bool(const Point&)> holds;
  std::string reason;
};
bool is_infinite(const Point& p) { return std::isinf(p[0]) || std::isinf(p[1]); }
const char* const strong_zeros_first =
    "a factor is infinite and another one 0: which of them is met first, as a strong zero, depends "
    "on the order";
const char* const no_real_power =
    "of a negative number only integer powers are real: by the exponent the derivative is NaN, and "
    "that of dx, which is 0 at exponent 0, is 1 / x";
const char* const opposite_infinities =
    "at a pole the adjoints of 1 - x and 1 + x, or of x - 1 and x + 1, are infinities whose sum is "
    "NaN; forward mode adds the tangents before the pole is met";
const std::vector<Exception> exceptions = {
    {"pow", is_infinite, strong_zeros_first},
    {"fast_pow", is_infinite, strong_zeros_first},
    {"hypot", is_infinite, strong_zeros_first},
    {"pow", [](const Point& p) { return p[0] < 0 && p[1] == 0; }, no_real_power},
    {"fast_pow", [](const Point& p) { return p[0] < 0 && p[1] == 0; }, no_real_power},
    {"acosh", [](const Point& p) { return p[0] == 1; }, opposite_infinities},
    {"atanh", [](const Point& p) { return std::abs(p[0]) == 1; }, opposite_infinities},
};

std::vector<Point> exceptional_points(const Operation& o) {
  std::vector<Point> result;
  for (double x : o.exceptional) {
    for (double y : o.arity > 1 ? o.exceptional : std::vector<double>{0}) {
      for (double w : o.arity > 2 ? std::vector<double>{0, 1, inf} : std::vector<double>{0})
        result.push_back({x, y, w});
    }
  }
  return result;
}

// The operands at points 0 to count - 1, as images.
template <typename T>
struct Operands {
  std::vector<Buffer<T>> values;
  Buffer<T> ones, chosen;
  int count;
  explicit Operands(const std::vector<Point>& points)
      : ones(static_cast<int>(points.size())),
        chosen(static_cast<int>(points.size())),
        count(static_cast<int>(points.size())) {
    for (size_t k = 0; k < 3; ++k) {
      values.emplace_back(count);
      for (int i = 0; i < count; ++i)
        values[k](i) = static_cast<T>(points[static_cast<size_t>(i)][k]);
    }
    ones.fill(1);
    chosen.fill(-1);
  }
  std::vector<Expr> at(const Var& i) const { return {values[0](i), values[1](i), values[2](i)}; }

  // The derivative of a pointwise Func, by an adjoint with a seed of ones or a tangent along ones.
  Func derivative(const Func& f, char mode, size_t by) const {
    const Buffer<T>& image = values[by];
    if (mode == 'f') return propagate_tangents(f, {{image, Direction::as_func(ones)}})(f);
    Func seed("seed");
    Var i("i");
    seed(i) = ones(i);
    return propagate_adjoints(f, seed, {{0, count}}, {.wrt = {image}}).of(image);
  }
  Func second(const Func& f, const std::string& modes, size_t first, size_t then) const {
    return derivative(derivative(f, modes[0], first), modes[1], then);
  }
};

struct Second {
  std::string modes;
  size_t first, then;
  std::vector<double> values;  // one a point
};

// The complete Hessian in all orders, by the interpreter or as machine code.
template <typename T>
std::vector<Second> all_seconds(const Operands<T>& operands, const Func& f, int arity,
                                bool is_compiled) {
  std::vector<Second> result;
  std::vector<Func> funcs;
  for (size_t a = 0; a < static_cast<size_t>(arity); ++a) {
    for (size_t b = 0; b < static_cast<size_t>(arity); ++b) {
      for (const char* modes : {"rf", "fr", "rr", "ff"}) {
        result.push_back({modes, a, b, {}});
        funcs.push_back(operands.second(f, modes, a, b));
      }
    }
  }
  if (is_compiled) {
    Realization found = Pipeline(funcs).realize({operands.count});
    for (size_t k = 0; k < funcs.size(); ++k) {
      const Buffer<T> values = found[k];
      for (int i = 0; i < operands.count; ++i) result[k].values.push_back(values(i));
    }
    return result;
  }
  for (size_t k = 0; k < funcs.size(); ++k) {
    const oracle::Array found =
        oracle::Interpreter().realize(funcs[k].function(), {{0}, {operands.count}}).front();
    for (const oracle::Value& v : found.values) result[k].values.push_back(v.scalar.as_double());
  }
  return result;
}

template <typename T>
Func pointwise(const Operation& o, const Operands<T>& operands) {
  Func f("f");
  Var i("i");
  f(i) = o.make(operands.at(i));
  return f;
}

std::string text_of(const Operation& o, const Point& p, const Second& s) {
  std::string result = o.name + "(";
  for (int k = 0; k < o.arity; ++k)
    result += (k ? ", " : "") + std::to_string(p[static_cast<size_t>(k)]);
  return result + ") by " + "xyw"[s.first] + " then " + "xyw"[s.then] + " in order " + s.modes;
}

// d2 f / da db by differences of values; the error is of fourth order in the step.
double difference(const Operands<double>&, const Operation& o, const Point& p, size_t a, size_t b) {
  const auto value = [&](double step_a, double step_b) {
    Point moved = p;
    moved[a] += step_a;
    moved[b] += step_b;
    const Operands<double> operands({moved});
    return evaluate(pointwise(o, operands), {{0}, {1}}).values[0].scalar.as_double();
  };
  const auto slope = [&](double h) {
    return (value(h, h) - value(h, -h) - value(-h, h) + value(-h, -h)) / (4 * h * h);
  };
  const double h = 2e-3;
  return (4 * slope(h / 2) - slope(h)) / 3;
}

bool agree(double a, double b, double tolerance) {
  if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && std::isnan(b);
  if (std::isinf(a) || std::isinf(b)) return a == b;
  return std::abs(a - b) <= tolerance * (1 + std::abs(a));
}

TEST(SecondDerivatives, AtRegularPointsAreThoseOfTheFunction) {
  for (const Operation& o : operations()) {
    const Operands<double> operands(o.regular);
    const auto found = all_seconds(operands, pointwise(o, operands), o.arity, false);
    for (const Second& s : found) {
      for (size_t i = 0; i < o.regular.size(); ++i) {
        const double expected = difference(operands, o, o.regular[i], s.first, s.then);
        EXPECT_TRUE(agree(s.values[i], expected, 2e-5))
            << text_of(o, o.regular[i], s) << ": " << s.values[i] << " instead of " << expected;
      }
    }
  }
}

// Compares with the first order of the modes as the reference.
template <typename T>
void expect_orders_agree(bool is_compiled, std::set<size_t>& needed) {
  const double tolerance = sizeof(T) == 8 ? 1e-9 : 1e-4;
  for (const Operation& o : operations()) {
    std::vector<Point> points = exceptional_points(o);
    points.insert(points.end(), o.regular.begin(), o.regular.end());
    const Operands<T> operands(points);
    const auto found = all_seconds(operands, pointwise(o, operands), o.arity, is_compiled);
    for (const Second& s : found) {
      const Second& measure = *std::find_if(found.begin(), found.end(), [&](const Second& m) {
        return std::set<size_t>{m.first, m.then} == std::set<size_t>{s.first, s.then};
      });
      for (size_t i = 0; i < points.size(); ++i) {
        if (agree(s.values[i], measure.values[i], tolerance)) continue;
        const auto why = std::find_if(exceptions.begin(), exceptions.end(), [&](const auto& e) {
          return e.operation == o.name && e.holds(points[i]);
        });
        if (why != exceptions.end()) {
          needed.insert(static_cast<size_t>(why - exceptions.begin()));
          continue;
        }
        ADD_FAILURE() << text_of(o, points[i], s) << ": " << s.values[i] << ", but "
                      << measure.values[i] << " in order " << measure.modes;
      }
    }
  }
}

TEST(SecondDerivatives, OrdersOfTheModesAgreeOrAReasonStands) {
  std::set<size_t> needed;
  expect_orders_agree<double>(false, needed);
  EXPECT_EQ(needed.size(), exceptions.size()) << "a reason for what agrees";
}
TEST(SecondDerivatives, OrdersOfTheModesAgreeInMachineCode) {
  std::set<size_t> needed;
  expect_orders_agree<float>(true, needed);
}

// q = 3 x^2 + 5 x y + 7 y^2 + 2 w^2 + x w where c > 0 does not hold.
template <typename T>
Expr chosen_arm(const std::vector<Expr>& a) {
  const auto num = [](double v) { return ir::make_const(type_of<T>(), v); };
  return num(3) * a[0] * a[0] + num(5) * a[0] * a[1] + num(7) * a[1] * a[1] + num(2) * a[2] * a[2] +
         a[0] * a[2];
}
double chosen_hessian(size_t a, size_t b) {
  const double hessian[3][3] = {{6, 5, 1}, {5, 14, 0}, {1, 0, 4}};
  return hessian[a][b];
}

// How the unselected arm reaches the select: within its expression, or through Funcs.
enum class Path { Inline, Func, Product, Chain };
template <typename T>
Func guarded(const Operation& o, const Operands<T>& operands, Path path) {
  Func arm("arm"), product("product"), f("f");
  Var i("i");
  const Expr e = o.make(operands.at(i)), is_taken = operands.chosen(i) > ir::make_zero(e.type());
  const Expr q = chosen_arm<T>(operands.at(i));
  arm(i) = e;
  product(i) = arm(i) * e * sqrt(arm(i));
  f(i) = select(is_taken,
                path == Path::Inline    ? e
                : path == Path::Func    ? arm(i)
                : path == Path::Product ? e * e * sqrt(e)
                                        : product(i),
                q);
  return f;
}

template <typename T>
void expect_unchosen_arms_contribute_nothing(Path path, bool is_compiled) {
  for (const Operation& o : operations()) {
    std::vector<Point> points = exceptional_points(o);
    std::erase_if(points, [](const Point& p) {  // the chosen arm is finite
      return std::isinf(p[0]) || std::isinf(p[1]) || std::isinf(p[2]);
    });
    const Operands<T> operands(points);
    const Func f = guarded(o, operands, path);
    for (const Second& s : all_seconds(operands, f, o.arity, is_compiled)) {
      for (size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(s.values[i], chosen_hessian(s.first, s.then)) << text_of(o, points[i], s);
      }
    }
  }
}

TEST(SecondDerivatives, AnUnchosenArmContributesNothing) {
  expect_unchosen_arms_contribute_nothing<double>(Path::Inline, false);
}
TEST(SecondDerivatives, AnUnchosenArmBehindAFuncContributesNothing) {
  expect_unchosen_arms_contribute_nothing<double>(Path::Func, false);
}
TEST(SecondDerivatives, AnUnchosenProductContributesNothing) {
  expect_unchosen_arms_contribute_nothing<double>(Path::Product, false);
}
TEST(SecondDerivatives, AnUnchosenChainOfFuncsContributesNothing) {
  expect_unchosen_arms_contribute_nothing<double>(Path::Chain, false);
}
TEST(SecondDerivatives, AnUnchosenArmContributesNothingInMachineCode) {
  expect_unchosen_arms_contribute_nothing<float>(Path::Inline, true);
}

// Hessians through the public functions.
class HessiansAtExceptionalPoints : public ::testing::Test {
 protected:
  Buffer<float> a = Buffer<float>(2), one = Buffer<float>(2);
  RDom r{0, 1};
  Var i{"i"};
  HessiansAtExceptionalPoints() { one.fill(1); }
  Expr at(int k) { return a(Expr(k)); }
  // The Hessian of loss(a(0), a(1)) at x, y.
  std::array<float, 4> hessian_of(const Func& loss, float x, float y) {
    a(0) = x;
    a(1) = y;
    std::array<float, 4> result{};
    for (int column = 0; column < 2; ++column) {
      Buffer<float> unit(2);
      unit.fill(0);
      unit(column) = 1;
      Buffer<float> found = hessian_vector_product(loss, a, {{a, unit}}).realize({2});
      for (int row = 0; row < 2; ++row) result[static_cast<size_t>(2 * row + column)] = found(row);
    }
    return result;
  }
  static std::array<float, 4> only_first(float v) { return {v, 0, 0, 0}; }
};

TEST_F(HessiansAtExceptionalPoints, OfARootThatIsNotChosen) {
  Func loss("loss");
  loss() = select(at(0) > 0, sqrt(at(0)), at(0) * at(0));
  EXPECT_EQ(hessian_of(loss, -1, 0), only_first(2));
  EXPECT_EQ(hessian_of(loss, 0, 0), only_first(2));
}

TEST_F(HessiansAtExceptionalPoints, OfALogarithmThatIsNotChosenBehindAFunc) {
  Func held("held"), logarithm("logarithm"), loss("loss");
  held(i) = a(i);
  logarithm(i) = log(held(i));
  loss() += select(a(r) > 0, logarithm(r), a(r) * a(r));
  held.compute_root();
  logarithm.compute_root();
  EXPECT_EQ(hessian_of(loss, -1, 0), only_first(2));
  EXPECT_EQ(hessian_of(loss, 0, 0), only_first(2));
}

TEST_F(HessiansAtExceptionalPoints, AsWholeMatrices) {
  Func loss("loss");
  RDom both(0, 2);
  loss() += select(a(both) > 0, sqrt(a(both)), a(both) * a(both));
  a(0) = -1;
  a(1) = 4;
  const Buffer<float> found = hessian(loss, a).dense().realize({2, 2});
  EXPECT_EQ(found(0, 0), 2);
  EXPECT_EQ(found(0, 1), 0);
  EXPECT_EQ(found(1, 0), 0);
  EXPECT_FLOAT_EQ(found(1, 1), -1.0f / 32);
}

TEST_F(HessiansAtExceptionalPoints, OfAPowerWhoseExponentIsZero) {
  Func loss("loss");
  loss() = pow(at(0), at(1));
  const auto found = hessian_of(loss, 2, 0);
  EXPECT_EQ(found[0], 0);
  EXPECT_FLOAT_EQ(found[1], 0.5f);
  EXPECT_FLOAT_EQ(found[2], 0.5f);
  EXPECT_FLOAT_EQ(found[3], std::log(2.0f) * std::log(2.0f));
}

TEST_F(HessiansAtExceptionalPoints, OfSquaresOfNormsAreThoseOfTheSumOfSquares) {
  const Expr x = at(0), y = at(1);
  for (const Expr& norm : {sqrt(x * x + y * y), hypot(x, y)}) {
    for (const Expr& square : {norm * norm, pow(norm, 2), 0.25f * norm * (norm * 4.0f)}) {
      Func loss("loss");
      loss() = square;
      for (const auto& [at_x, at_y] : {std::pair{0.0f, 0.0f}, {0.0f, 2.0f}, {3.0f, 4.0f}}) {
        const auto found = hessian_of(loss, at_x, at_y);
        EXPECT_NEAR(found[0], 2, 1e-6) << square;
        EXPECT_NEAR(found[1], 0, 1e-6) << square;
        EXPECT_NEAR(found[2], 0, 1e-6) << square;
        EXPECT_NEAR(found[3], 2, 1e-6) << square;
      }
    }
  }
}

TEST_F(HessiansAtExceptionalPoints, OfCubesOfNorms) {
  const Expr norm = sqrt(at(0) * at(0) + at(1) * at(1));
  Func loss("loss");
  loss() = norm * norm * norm;
  EXPECT_EQ(hessian_of(loss, 0, 0), only_first(0));
  const auto found = hessian_of(loss, 0, 2);
  EXPECT_NEAR(found[0], 6, 1e-5);
  EXPECT_NEAR(found[1], 0, 1e-5);
  EXPECT_NEAR(found[2], 0, 1e-5);
  EXPECT_NEAR(found[3], 12, 1e-5);
}

}  // namespace
}  // namespace retrograde::gradient
