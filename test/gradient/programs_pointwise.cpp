// Suite programs of a single point: operators, selections, conversions, Tuples, parameters, approximations.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x");

Program of(const Expr& value, const std::vector<Buffer<float>>& inputs) {
  Func f("f");
  f(x) = value;
  return {weighted_sum(f, {9}), inputs};
}

PROGRAM(polynomial) {
  Buffer<float> a = line();
  return of(a(x) * a(x) * a(x) - 2.0f * a(x) + 1.0f, {a});
}
PROGRAM(rational) {
  Buffer<float> a = line(), b = line(9, 4);
  return of((a(x) - b(x)) / (a(x) + b(x)), {a, b});
}
PROGRAM(exponentials) {
  Buffer<float> a = line();
  return of(exp(-a(x)) * log(a(x)) + sqrt(a(x)), {a});
}
PROGRAM(powers) {
  Buffer<float> a = line(), b = line(9, 4);
  return of(pow(a(x), b(x)) + pow(a(x), 3.0f) + pow(2.0f, b(x)), {a, b});
}
PROGRAM(trigonometry) {
  Buffer<float> a = random_image({9}, 0.125, 0.875, 4);
  return of(sin(a(x)) * cos(a(x)) + tan(a(x)) + asin(a(x)) * acos(a(x)) + atan(a(x)), {a});
}
PROGRAM(hyperbolic) {
  Buffer<float> a = random_image({9}, 0.125, 0.875, 4);
  return of(sinh(a(x)) * tanh(a(x)) + cosh(a(x)) + asinh(a(x)) + atanh(a(x)) + acosh(a(x) + 1.5f),
            {a});
}
PROGRAM(angle_of_a_vector) {
  Buffer<float> a = line(), b = line(9, 4);
  return of(atan2(a(x), b(x)) + atan2(-a(x), b(x) - 3.0f), {a, b});
}
PROGRAM(length_of_a_vector) {
  Buffer<float> a = line(), b = line(9, 4);
  return of(sqrt(a(x) * a(x) + b(x) * b(x)) + hypot(a(x), 2.0f * b(x)), {a, b});
}
PROGRAM(logistic) {
  Buffer<float> a = random_image({9}, -2, 2, 4);
  return of(1.0f / (1.0f + exp(-a(x))), {a});
}
PROGRAM(absolute_values) {
  Buffer<float> a = random_image({9}, -2, 2, 4);
  return of(abs(a(x)) * abs(a(8 - x)), {a});
}
PROGRAM(minimum_maximum_and_clamp) {
  Buffer<float> a = line();
  return of(max(a(x), 1.25f * a(8 - x)) + min(a(x), 1.0f) * clamp(a(x), 0.5f, 1.5f), {a});
}
PROGRAM(select_by_value) {
  Buffer<float> a = line();
  return of(select(a(x) > 1.0f, a(x) * 3.0f, a(x) * a(x)), {a});
}
PROGRAM(select_of_many) {
  Buffer<float> a = line();
  return of(select(a(x) < 0.5f, a(x), a(x) < 1.0f, a(x) * a(x), a(x) < 1.5f, 2.0f, -a(x)), {a});
}
PROGRAM(interpolation) {
  Buffer<float> a = line(), b = line(9, 4), w = random_image({9}, 0.125, 0.875, 5);
  return of(lerp(a(x), b(x), w(x)), {a, b, w});
}
PROGRAM(fractional_part) {
  Buffer<float> a = line();
  return of((a(x) * 4.0f - floor(a(x) * 4.0f)) * a(x), {a});
}
PROGRAM(float_modulus) {
  Buffer<float> a = line();
  return of(a(x) % 0.75f + (-a(x)) % 1.25f, {a});
}
PROGRAM(through_double_and_back) {
  Buffer<float> a = line();
  return of(cast<float>(sin(cast<double>(a(x))) * cast<double>(a(x))), {a});
}
PROGRAM(fast_inverses) {
  Buffer<float> a = line();
  return of(fast_inverse(a(x)) + fast_inverse_sqrt(a(x) + 1.0f), {a});
}
PROGRAM(fast_exponentials) {
  Buffer<float> a = line();
  return of(fast_exp(a(x)) * fast_log(a(x) + 1.0f) + fast_pow(a(x), 1.5f), {a});
}
PROGRAM(fast_sine_and_cosine) {
  Buffer<float> a = line();
  return of(fast_sin(a(x)) * fast_cos(a(8 - x)), {a});
}
PROGRAM(values_shared_by_many) {
  Buffer<float> a = line();
  Expr e = a(x);
  for (int i = 0; i < 12; ++i) e = sin(e) * e * 0.25f + e;
  return of(e, {a});
}
PROGRAM(marked_values) {
  Buffer<float> a = line();
  return of(likely(a(x) * a(x)) + likely_if_innermost(sin(a(x))) + strict_float(a(x) / 3.0f), {a});
}
PROGRAM_OF(tuple_of_four, line()) {
  Func g("g");
  f(x) = Tuple(a(x), a(x) * a(x), sin(a(x)), exp(-a(x)));
  g(x) = f(x)[0] * f(x)[3] + f(x)[1] * f(8 - x)[2];
  return {weighted_sum(g, {9}), {a}};
}
PROGRAM_OF(tuple_with_an_integer, line()) {
  Func g("g");
  f(x) = Tuple(a(x) * a(x), cast<int>(a(x) * 4.0f));
  g(x) = f(x)[0] * cast<float>(f(x)[1]);
  return {weighted_sum(g, {9}), {a}};
}
PROGRAM_OF(gradient_of_a_gradient, line()) {
  f(x) = a(x) * a(x) * a(8 - x);
  return {weighted_sum(propagate_adjoints(weighted_sum(f, {9}))(a), {9}), {a}};
}

PROGRAM_OF(pointwise, line()) {
  f(x) = a(x) * a(x) + exp(-a(x)) * 2.0f;
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(select_and_min_max, line()) {
  f(x) = select(a(x) > 1.0f, a(x) * 3.0f, a(x) * a(x)) + max(a(x), 1.25f * a(x + 1)) +
         clamp(a(x), 0.5f, 1.5f);
  return {weighted_sum(f, {8}), {a}};
}

}  // namespace
}  // namespace retrograde::gradient
