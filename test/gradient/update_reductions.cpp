// Suite programs that reduce: sums of every shape, and associative operators other than sums.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), c("c");

PROGRAM_OF(sum_of_all, plane()) {
  RDom r(0, 7, 0, 6);
  f() = 0.0f;
  f() += a(r.x, r.y) * a(r.x, r.y);
  return {f, {a}};
}

PROGRAM(mean_and_variance) {
  Buffer<float> a = line();
  Func mean("mean"), loss("loss");
  RDom r(0, 9);
  mean() = 0.0f;
  mean() += a(r) / 9.0f;
  loss() = 0.0f;
  loss() += (a(r) - mean()) * (a(r) - mean()) * cast<float>(r + 1);
  return {loss, {a}};
}

PROGRAM_OF(sums_along_rows, plane()) {
  RDom r(0, 7);
  f(y) = 0.0f;
  f(y) += a(r, y) * a(6 - r, y);
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM_OF(matrix_product, plane(4, 3)) {
  Buffer<float> b = plane(5, 4, 8);
  RDom k(0, 4);
  f(x, y) = 0.0f;
  f(x, y) += a(k, y) * b(x, k);
  return {weighted_sum(f, {5, 3}), {a, b}};
}

PROGRAM_OF(convolution_with_a_learned_kernel, plane()) {
  Buffer<float> k = random_image({3, 3}, -1, 1, 8);
  RDom r(0, 3, 0, 3);
  f(x, y) = 0.0f;
  f(x, y) += a(x + r.x, y + r.y) * k(r.x, r.y);
  return {weighted_sum(f, {5, 4}), {a, k}};
}

PROGRAM_OF(strided_convolution_with_a_learned_kernel, plane(9, 7)) {
  Buffer<float> k = random_image({3, 3}, -1, 1, 8);
  RDom r(0, 3, 0, 3);
  f(x, y) = 0.0f;
  f(x, y) += a(2 * x + r.x, 2 * y + r.y) * k(r.x, r.y);
  return {weighted_sum(f, {4, 3}), {a, k}};
}

PROGRAM_OF(depthwise_convolution, random_image({5, 4, 3}, -1, 1, 8)) {
  Buffer<float> k = random_image({2, 2, 3}, -1, 1, 9);
  RDom r(0, 2, 0, 2);
  f(x, y, c) = 0.0f;
  f(x, y, c) += a(x + r.x, y + r.y, c) * k(r.x, r.y, c);
  return {weighted_sum(f, {4, 3, 3}), {a, k}};
}

PROGRAM_OF(transposed_convolution_scatters_in_the_primal, line(5)) {
  Buffer<float> k = random_image({3}, -1, 1, 8);
  RDom r(0, 3, 0, 5);
  f(x) = 0.0f;
  f(2 * r.y + r.x) += a(r.y) * k(r.x);
  return {weighted_sum(f, {11}), {a, k}};
}

PROGRAM_OF(sum_over_a_triangle, plane(6, 6)) {
  RDom r(0, 6, 0, 6);
  r.where(r.x <= r.y && r.x + r.y < 8);
  f(x) = 0.0f;
  f(r.x) += a(r.x, r.y) * a(r.y, r.x);
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM_OF(sum_where_data_say, line()) {
  RDom r(0, 9);
  r.where(a(r) > 1.0f);
  f() = 0.0f;
  f() += a(r) * a(8 - r);
  return {f, {a}};
}

PROGRAM_OF(reduction_domain_that_starts_at_minus_two, line()) {
  RDom r(-2, 5);
  f(x) = 0.0f;
  f(x) += a(clamp(x + r, 0, 8)) * cast<float>(r + 3);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(product_of_all, line(6)) {
  RDom r(0, 6);
  f() = 1.0f;
  f() *= a(r);
  return {f, {a}, true};
}

PROGRAM_OF(product_with_one_zero, line(6)) {
  a(2) = 0.0f;
  RDom r(0, 6);
  f() = 1.0f;
  f() *= a(r);
  return {f, {a}, true};
}

PROGRAM_OF(products_along_rows, plane()) {
  RDom r(0, 7);
  f(y) = 1.0f;
  f(y) *= a(r, y);
  return {weighted_sum(f, {6}), {a}, true};
}

PROGRAM_OF(product_where_data_say, plane()) {
  RDom r(0, 7);
  r.where(a(r, 2) > 1.0f);
  f(y) = a(3, y);
  f(y) *= a(r, y);
  return {weighted_sum(f, {6}), {a}, true};
}

PROGRAM_OF(product_over_two_dimensions, random_image({3, 4}, 0.75, 1.25, 2)) {
  RDom r(0, 3, 1, 3);
  f() = a(0, 0);
  f() *= a(r.x, r.y);
  return {f, {a}, true};
}

PROGRAM_OF(decay_in_place_of_what_a_counter_has_reached, plane()) {
  Func g("g");
  RDom r(0, 7);
  f(y) = Tuple(a(0, y), 0, 1.0f);
  f(y) = Tuple(0.5f * f(y)[0] + a(r, y) * a(r, y), f(y)[1] + 1, a(r, y) + 0.25f * f(y)[0]);
  g(y) = f(y)[0] * cast<float>(f(y)[1]) + f(y)[2];
  return {weighted_sum(g, {6}), {a}};
}

PROGRAM_OF(maximum_and_minimum, line()) {
  RDom r(0, 4);
  f(x) = maximum(a(x + r)) * minimum(a(x + r) * 2.0f);
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM_OF(maximum_of_a_product, plane()) {
  RDom r(0, 7);
  f(y) = -10.0f;
  f(y) = max(a(r, y) * a(r, 5 - y), f(y));
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM_OF(argmax_carries_its_value, line()) {
  RDom r(0, 4);
  f(x) = argmax(a(x + r))[1] * 3.0f;
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM(argmin_chooses_where_another_image_is_read) {
  Buffer<float> a = line(), b = line(9, 7);
  Func best("best"), f("f");
  RDom r(0, 4);
  best(x) = argmin(a(x + r));
  f(x) = b(x + clamp(best(x)[0], 0, 3)) * best(x)[1];
  return {weighted_sum(f, {6}), {a, b}};
}

PROGRAM(log_sum_exp_after_the_maximum) {
  Buffer<float> a = line();
  Func top("top"), f("f");
  RDom r(0, 9);
  top() = maximum(a(r));
  f() = log(sum(exp(a(r) - top()))) + top();
  return {f, {a}};
}

PROGRAM_OF(log_sum_exp_as_an_operator, line(6)) {
  RDom r(1, 5);
  f() = a(Expr(0));
  f() = log(exp(f()) + exp(a(r)));
  return {f, {a}, true};
}

PROGRAM_OF(streaming_log_sum_exp_in_a_tuple, line(6)) {
  Func g("g");
  RDom r(0, 6);
  f() = Tuple(-4.0f, 0.0f);
  Expr top = max(f()[0], a(r));
  f() = Tuple(top, f()[1] * exp(f()[0] - top) + exp(a(r) - top));
  g() = f()[0] + log(f()[1]);
  return {g, {a}, true};
}

PROGRAM(softmax) {
  Buffer<float> a = line();
  Func e("e"), total("total"), f("f");
  RDom r(0, 9);
  e(x) = exp(a(x));
  total() = 0.0f;
  total() += e(r);
  f(x) = e(x) / total();
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM(complex_product_in_a_tuple) {
  Buffer<float> re = line(5), im = line(5, 7);
  Func f("f"), g("g");
  RDom r(0, 5);
  f() = Tuple(1.0f, 0.0f);
  f() = Tuple(f()[0] * re(r) - f()[1] * im(r), f()[0] * im(r) + f()[1] * re(r));
  g() = f()[0] + 2.0f * f()[1];
  return {g, {re, im}, true};
}

PROGRAM_OF(two_sums_in_a_tuple, line()) {
  Func g("g");
  RDom r(0, 4);
  f(x) = Tuple(0.0f, 1.0f);
  f(x) = Tuple(f(x)[0] + a(x + r), f(x)[1] + a(x + r) * a(x + r));
  g(x) = f(x)[1] - f(x)[0] * f(x)[0] * 0.25f;
  return {weighted_sum(g, {6}), {a}};
}

PROGRAM(alpha_compositing_front_to_back) {
  Buffer<float> color = plane(4, 5), alpha = random_image({4, 5}, 0.125, 0.875, 3);
  Func f("f"), g("g");
  RDom r(0, 5);
  f(x) = Tuple(0.0f, 1.0f);
  f(x) = Tuple(f(x)[0] + f(x)[1] * alpha(x, r) * color(x, r), f(x)[1] * (1.0f - alpha(x, r)));
  g(x) = f(x)[0] + 0.5f * f(x)[1];
  return {weighted_sum(g, {4}), {color, alpha}, true};
}

PROGRAM(distance_with_a_learned_center) {
  Buffer<float> a = plane(4, 3), b = plane(4, 2, 8);
  Func d("d"), f("f");
  RDom r(0, 4);
  d(x, y) = 0.0f;
  d(x, y) += (a(r, x) - b(r, y)) * (a(r, x) - b(r, y));
  f(x, y) = sqrt(d(x, y) + 0.125f);
  return {weighted_sum(f, {3, 2}), {a, b}};
}

}  // namespace
}  // namespace retrograde::gradient
