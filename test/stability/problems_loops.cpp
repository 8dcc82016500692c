// Problems of the stability suite: reductions and recurrences that carry extremes through sums, products, histograms
// and scans, including stiff and chaotic ones.
#include "frontend/language/inline_reductions.h"
#include "stability/problems.h"

namespace retrograde::stability {

namespace {

constexpr int n = 6;  // numbers in a case

using Numbers = std::vector<Traced>;
using Value = std::function<Traced(const Numbers&)>;

Problem program(const std::string& name, const Build& build, const Value& value,
                const ExactGradient& exact = {}) {
  return {name, n, build, value, exact};
}

Func sum_of_squares(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n);
  Func f("squares");
  f(c) = 0.0f;
  f(c) += in(r, c) * in(r, c);
  return f;
}

Func norm(const Buffer<float>& in) {
  Var c("c");
  Func f("f");
  f(c) = sqrt(sum_of_squares(in)(c));
  return f;
}
Func first_of_unit_vector(const Buffer<float>& in) {
  Var c("c"), i("i");
  Func length = norm(in), unit("unit"), f("f");
  unit(i, c) = in(i, c) / length(c);
  f(c) = unit(0, c);
  return f;
}
Traced length_of(const Numbers& x) {
  Traced sum = 0;
  for (const Traced& v : x) sum = sum + v * v;
  return sqrt(sum);
}
// Divides by x² + y² of the other numbers, so that nothing cancels.
Reals unit_vector_gradient(const Reals& x) {
  Real others = 0, length = 0;
  for (size_t i = 1; i < x.size(); ++i) others += x[i] * x[i];
  length = std::sqrt(others + x[0] * x[0]);
  Reals result{others / length / length / length};
  for (size_t i = 1; i < x.size(); ++i) result.push_back(-x[0] / length * (x[i] / length) / length);
  return result;
}

Func log_sum_exp(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n), q(0, n);
  Func top("top"), total("total"), f("f");
  top(c) = in(0, c);
  top(c) = max(top(c), in(r, c));
  total(c) = 0.0f;
  total(c) += exp(in(q, c) - top(c));
  f(c) = log(total(c)) + top(c);
  return f;
}
Func naive_log_sum_exp(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n);
  Func total("total"), f("f");
  total(c) = 0.0f;
  total(c) += exp(in(r, c));
  f(c) = log(total(c));
  return f;
}
Reals softmax(const Reals& x) {
  Reals result;
  Real top = x[0], sum = 0;
  for (Real v : x) top = std::max(top, v);
  for (Real v : x) result.push_back(std::exp(v - top)), sum += result.back();
  for (Real& v : result) v /= sum;
  return result;
}

Func product(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n);
  Func f("f");
  f(c) = 1.0f;
  f(c) *= in(r, c);
  return f;
}
// Takes products of the other numbers, to avoid a quotient by zero.
Reals product_gradient(const Reals& x) {
  Reals result(x.size(), 1);
  for (size_t i = 0; i < x.size(); ++i) {
    for (size_t k = 0; k < x.size(); ++k) result[i] *= k == i ? 1 : x[k];
  }
  return result;
}

Func largest(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n);
  Func f("f");
  f(c) = in(0, c);
  f(c) = max(f(c), in(r, c));
  return f;
}

Func variance_by_squares(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n);
  Func mean("mean"), square("square"), f("f");
  mean(c) = 0.0f;
  mean(c) += in(r, c) * (1.0f / n);
  square(c) = sum_of_squares(in)(c) * (1.0f / n);
  f(c) = square(c) - mean(c) * mean(c);
  return f;
}
Func variance_in_two_passes(const Buffer<float>& in) {
  Var c("c");
  RDom r(0, n), q(0, n);
  Func mean("mean"), f("f");
  mean(c) = 0.0f;
  mean(c) += in(r, c) * (1.0f / n);
  f(c) = 0.0f;
  f(c) += (in(q, c) - mean(c)) * (in(q, c) - mean(c)) * (1.0f / n);
  return f;
}
// 2 (x_i - mean) / n: the derivative of both formulas.
Reals variance_gradient(const Reals& x) {
  Real mean = 0;
  for (Real v : x) mean += v / static_cast<Real>(x.size());
  Reals result;
  for (Real v : x) result.push_back(2 * (v - mean) / static_cast<Real>(x.size()));
  return result;
}

Expr bin_of(const Expr& v) { return cast<int>(clamp(v, 0.0f, 3.0f)); }
// Weights |v| are collected in four bins by v, and the roots of the bins are summed. An empty bin is at a pole.
Func roots_of_histogram(const Buffer<float>& in) {
  Var c("c"), b("b");
  RDom r(0, n), q(0, 4);
  Func bins("bins"), f("f");
  bins(b, c) = 0.0f;
  bins(bin_of(in(r, c)), c) += abs(in(r, c));
  f(c) = 0.0f;
  f(c) += sqrt(bins(q, c));
  return f;
}
Traced roots_of_histogram_of(const Numbers& x) {
  Numbers bins(4);
  for (const Traced& v : x) {
    Traced& bin = bins[static_cast<size_t>(clamp(v, 0.0f, 3.0f).own)];
    bin = bin + abs(v);
  }
  Traced sum = 0;
  for (const Traced& b : bins) sum = sum + sqrt(b);
  return sum;
}

// Iterates y = step(y, a) `steps` times from the first number; a is the last number.
template <class F>
Problem iterated(const std::string& name, int numbers, int steps, F step) {
  auto build = [steps, step, numbers](const Buffer<float>& in) {
    Var c("c"), t("t");
    RDom r(1, steps);
    Func y("y"), f("f");
    y(c, t) = in(0, c);
    y(c, r) = step(Expr(y(c, r - 1)), Expr(in(numbers - 1, c)));
    f(c) = y(c, steps);
    return f;
  };
  auto value = [steps, step](const auto& x) {
    auto y = x[0];
    for (int t = 0; t < steps; ++t) y = step(y, x.back());
    return y;
  };
  return {name, numbers, build, value, {}};
}

// A recursive filter with a pole near 1, over the numbers of a case in order.
Func leaky_sum(const Buffer<float>& in) {
  Var c("c"), t("t");
  RDom r(1, n - 1);
  Func y("y"), f("f");
  y(t, c) = in(0, c);
  y(r, c) = 0.999f * y(r - 1, c) + (1 - 0.999f) * in(r, c);
  f(c) = y(n - 1, c);
  return f;
}
Traced leaky_sum_of(const Numbers& x) {
  Traced y = x[0];
  for (size_t i = 1; i < x.size(); ++i) y = 0.999f * y + (1 - 0.999f) * x[i];
  return y;
}
// Each step keeps the longest vector (y, x) has been projected on: sqrt inside of a scan.
Func running_norm(const Buffer<float>& in) {
  Var c("c"), t("t");
  RDom r(1, n - 1);
  Func y("y"), f("f");
  y(t, c) = abs(in(0, c));
  y(r, c) = sqrt(y(r - 1, c) * y(r - 1, c) + in(r, c) * in(r, c));
  f(c) = y(n - 1, c);
  return f;
}

}  // namespace

Family reductions() {
  auto log_sum = [](const auto& x) {
    auto sum = exp(x[0]);
    for (size_t i = 1; i < x.size(); ++i) sum = sum + exp(x[i]);
    return log(sum);
  };
  auto largest_of = [](const auto& x) {
    auto m = x[0];
    for (const auto& v : x) m = max(m, v);
    return m;
  };
  auto mean_of = [](const auto& x) {
    auto sum = x[0];
    for (size_t i = 1; i < x.size(); ++i) sum = sum + x[i];
    return sum * (1.0f / n);
  };
  return {"Reductions",
          {
              program("norm of six", norm, [](const auto& x) { return length_of(x); }),
              program(
                  "six numbers over their norm", first_of_unit_vector,
                  [](const auto& x) { return x[0] / length_of(x); }, unit_vector_gradient),
              program("log-sum-exp of six", naive_log_sum_exp, log_sum, softmax),
              program(
                  "log-sum-exp of six, shifted by the largest", log_sum_exp,
                  [log_sum, largest_of](auto x) {
                    auto m = largest_of(x);
                    for (auto& v : x) v = v - m;
                    return log_sum(x) + m;
                  },
                  softmax),
              program(
                  "product of six", product,
                  [](const auto& x) { return x[0] * x[1] * x[2] * x[3] * x[4] * x[5]; },
                  product_gradient),
              program("largest of six", largest, largest_of),
              program(
                  "variance as E[x²] - E[x]²", variance_by_squares,
                  [mean_of](auto x) {
                    auto m = mean_of(x);
                    for (auto& v : x) v = v * v;
                    return mean_of(x) - m * m;
                  },
                  variance_gradient),
              program(
                  "variance in two passes", variance_in_two_passes,
                  [mean_of](auto x) {
                    auto m = mean_of(x);
                    for (auto& v : x) v = (v - m) * (v - m);
                    return mean_of(x);
                  },
                  variance_gradient),
              program("roots of a histogram's bins", roots_of_histogram,
                      [](const auto& x) { return roots_of_histogram_of(x); }),
          }};
}

Family recurrences() {
  return {"Recurrences",
          {
              program("recursive filter, pole at 0.999", leaky_sum,
                      [](const auto& x) { return leaky_sum_of(x); }),
              program("running norm", running_norm,
                      [](const auto& x) {
                        auto y = abs(x[0]);
                        for (size_t i = 1; i < x.size(); ++i) y = sqrt(y * y + x[i] * x[i]);
                        return y;
                      }),
              iterated("explicit Euler, y - 50 y, 12 steps", 1, 12,
                       [](const auto& y, const auto&) { return y - 50.0f * y; }),
              iterated("explicit Euler, y + h (y - y³), 10 steps", 2, 10,
                       [](const auto& y, const auto& h) { return y + h * (y - y * y * y); }),
              iterated("implicit Euler, y / (1 + h), 20 steps", 2, 20,
                       [](const auto& y, const auto& h) { return y / (1.0f + h); }),
              iterated("logistic map, 4 y (1 - y), 20 steps", 1, 20,
                       [](const auto& y, const auto&) { return 4.0f * y * (1.0f - y); }),
              iterated("Newton's square root, 8 steps", 2, 8,
                       [](const auto& y, const auto& a) { return 0.5f * (y + a / y); }),
              iterated("tanh(y + a), 10 steps", 2, 10,
                       [](const auto& y, const auto& a) { return tanh(y + a); }),
              iterated("clamp(8 y, 0, 1), 10 steps", 1, 10,
                       [](const auto& y, const auto&) { return clamp(8.0f * y, 0.0f, 1.0f); }),
          }};
}

}  // namespace retrograde::stability
