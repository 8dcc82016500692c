// Suite programs with recurrences: scans forward and backward, in one and several dimensions, with several taps and
// coupled Tuples. The loss reads every step, so that a lost one shows.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), t("t");

PROGRAM_OF(cumulative_sum, line()) {
  RDom r(1, 8);
  f(x) = a(x);
  f(r) += f(r - 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(cumulative_sum_from_the_right, line()) {
  RDom r(0, 8);
  f(x) = a(x) * a(x);
  f(7 - r) += f(8 - r);
  return {weighted_sum(f, {9}), {a}};
}

// Only a first iteration could read a(0), but there is no iteration.
PROGRAM_OF(shift_of_no_elements, line()) {
  Param<int> n("n");
  n.set(0);
  RDom r(0, n);
  f(x) = a(x);
  f(r) = f(clamp(r - 1, 0, 8));
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(exponential_filter, line()) {
  RDom r(1, 8);
  f(x) = a(x);
  f(r) = 0.25f * f(r) + 0.75f * f(r - 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(filter_forward_then_backward, line()) {
  RDom r(1, 8);
  f(x) = a(x) * a(x);
  f(r) = 0.25f * f(r) + 0.75f * f(r - 1);
  f(8 - r) = 0.25f * f(8 - r) + 0.75f * f(9 - r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(filter_with_learned_decay, line()) {
  Buffer<float> decay = random_image({2}, 0.25, 0.75, 8);
  Func g("g");
  RDom r(0, 9);
  f(t) = 0.0f;
  f(r + 1) = decay(Expr(0)) * f(r) + decay(Expr(1)) * a(r);
  g(x) = f(x + 1);
  return {weighted_sum(g, {9}), {a, decay}};
}

PROGRAM_OF(two_pole_filter, line()) {
  RDom r(2, 7);
  f(x) = a(x);
  f(r) = f(r) + 0.5f * f(r - 1) - 0.25f * f(r - 2);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(two_pole_filter_backward_nonlinear, line()) {
  RDom r(0, 7);
  f(x) = a(x);
  f(6 - r) = a(6 - r) + 0.25f * f(7 - r) * f(8 - r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(fibonacci_of_products, line()) {
  RDom r(0, 7);
  f(t) = 1.0f;
  f(r + 2) = f(r + 1) * a(r) + f(r) * a(r + 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(scan_of_every_second_element, line()) {
  RDom r(1, 4);
  f(x) = a(x);
  f(2 * r) = f(2 * r - 2) * a(r) + f(2 * r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(scan_from_three_whose_steps_are_all_read, line()) {
  RDom r(3, 4);
  f(x) = a(x) * a(x);
  f(r) = sin(f(r - 1)) + a(r - 2);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(scan_from_a_negative_start, line()) {
  Func g("g");
  RDom r(-3, 6);
  f(x) = a(clamp(x + 4, 0, 8));
  f(r) = f(r - 1) * a(r + 3) + 0.5f * f(r);
  g(x) = f(x - 4);
  return {weighted_sum(g, {8}), {a}};
}

PROGRAM(logistic_map) {
  Buffer<float> a = random_image({5}, 0.25, 0.75, 4);
  Func u("u");
  RDom r(0, 4);
  u(x, t) = 0.0f;
  u(x, 0) = a(clamp(x, 0, 4));
  u(x, r + 1) = 3.0f * u(x, r) * (1.0f - u(x, r));
  return {weighted_sum(u, {5, 5}), {a}};
}

PROGRAM(only_the_last_step_is_read) {
  Buffer<float> a = random_image({5}, 0.25, 0.75, 4);
  Func u("u"), last("last");
  RDom r(0, 4);
  u(x, t) = a(clamp(x, 0, 4));
  u(x, r + 1) = u(x, r) + 0.25f * sin(u(x, r));
  last(x) = u(x, 4);
  return {weighted_sum(last, {5}), {a}};
}

PROGRAM(explicit_euler_with_a_force_at_each_step) {
  Buffer<float> force = plane(5, 6, 9);
  Func u("u");
  RDom r(0, 6);
  u(x, t) = Tuple(1.0f, 0.0f);
  u(x, r + 1) = Tuple(u(x, r)[0] + 0.25f * u(x, r)[1],
                      u(x, r)[1] + 0.25f * (force(clamp(x, 0, 4), r) - sin(u(x, r)[0])));
  Func g("g");
  g(x, y) = u(x, y)[0] + 0.5f * u(x, y)[1];
  return {weighted_sum(g, {5, 7}), {force}};
}

PROGRAM(symplectic_euler_in_two_updates) {
  Buffer<float> a = line();
  Func q("q");
  RDom r(0, 6);
  q(t) = Tuple(a(Expr(0)), a(Expr(1)));
  q(r + 1) = Tuple(q(r)[0] + 0.25f * (q(r)[1] - 0.25f * sin(q(r)[0]) * a(r)),
                   q(r)[1] - 0.25f * sin(q(r)[0]) * a(r));
  Func g("g");
  g(x) = q(x)[0] * q(x)[1];
  return {weighted_sum(g, {7}), {a}};
}

// u(x, t + 1) = step(u(x - 1, t), u(x, t), u(x + 1, t)); the ends of the line stay unchanged.
template <class Step>
Program steps_over_a_stencil(int steps, const Step& step) {
  Buffer<float> a = line();
  Func u("u");
  RDom r(0, 9, 0, steps);
  u(x, t) = 0.0f;
  u(x, 0) = a(clamp(x, 0, 8));
  const auto now = [&](const Expr& at) { return Expr(u(at, r.y)); };
  u(r.x, r.y + 1) = step(now(clamp(r.x - 1, 0, 8)), now(r.x), now(clamp(r.x + 1, 0, 8)));
  return {weighted_sum(u, {9, steps + 1}), {a}};
}

PROGRAM(diffusion_over_a_stencil) {
  return steps_over_a_stencil(3, [](const Expr& left, const Expr& mid, const Expr& right) {
    return mid + 0.25f * (left - 2.0f * mid + right);
  });
}

PROGRAM(reaction_and_diffusion_over_a_stencil) {
  return steps_over_a_stencil(4, [](const Expr& left, const Expr& mid, const Expr& right) {
    return mid + 0.25f * (left - 2.0f * mid + right) + 0.125f * mid * left;
  });
}

PROGRAM(burgers_over_a_stencil) {
  return steps_over_a_stencil(3, [](const Expr& left, const Expr& mid, const Expr&) {
    return mid - 0.125f * mid * (mid - left);
  });
}

PROGRAM(wave_with_two_steps_of_memory) {
  Buffer<float> a = line();
  Func u("u");
  RDom r(1, 7, 1, 3);
  u(x, t) = a(clamp(x, 0, 8)) * cast<float>(t + 1);
  u(r.x, r.y + 1) = 2.0f * u(r.x, r.y) - u(r.x, r.y - 1) +
                    0.25f * (u(r.x - 1, r.y) - 2.0f * u(r.x, r.y) + u(r.x + 1, r.y));
  return {weighted_sum(u, {9, 5}), {a}};
}

PROGRAM_OF(summed_area_table, plane()) {
  RDom rx(1, 6), ry(1, 5);
  f(x, y) = a(x, y) * a(x, y);
  f(rx, y) += f(rx - 1, y);
  f(x, ry) += f(x, ry - 1);
  return {weighted_sum(f, {7, 6}), {a}};
}

PROGRAM_OF(summed_area_table_in_one_update, plane(5, 4)) {
  RDom r(1, 4, 1, 3);
  f(x, y) = a(x, y) * a(x, y);
  f(r.x, r.y) = f(r.x, r.y) + f(r.x - 1, r.y) + f(r.x, r.y - 1) - f(r.x - 1, r.y - 1);
  return {weighted_sum(f, {5, 4}), {a}};
}

PROGRAM_OF(dynamic_programming_along_diagonals, plane(5, 4)) {
  RDom r(1, 4, 1, 3);
  f(x, y) = a(x, y);
  f(r.x, r.y) = a(r.x, r.y) + 0.5f * f(r.x - 1, r.y - 1) + 0.25f * sin(f(r.x, r.y - 1));
  return {weighted_sum(f, {5, 4}), {a}};
}

PROGRAM_OF(shortest_path_by_min, plane(5, 4)) {
  RDom r(1, 3, 1, 3);
  f(x, y) = a(x, y);
  f(r.x, r.y) = a(r.x, r.y) + min(f(r.x - 1, r.y - 1), min(f(r.x, r.y - 1), f(r.x + 1, r.y - 1)));
  return {weighted_sum(f, {5, 4}), {a}};
}

PROGRAM(soft_alignment) {
  Buffer<float> cost = plane(4, 4);
  Func d("d");
  RDom r(1, 4, 1, 4);
  d(x, y) = select(x == 0 && y == 0, 0.0f, 4.0f);
  Expr soft = -log(exp(-d(r.x - 1, r.y - 1)) + exp(-d(r.x - 1, r.y)) + exp(-d(r.x, r.y - 1)));
  d(r.x, r.y) = cost(r.x - 1, r.y - 1) + soft;
  return {weighted_sum(d, {5, 5}), {cost}};
}

PROGRAM_OF(gauss_seidel_sweep, line()) {
  RDom r(1, 7);
  f(x) = a(x) * a(x);
  f(r) = 0.5f * f(r - 1) + 0.25f * f(r) + 0.25f * f(r + 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(gauss_seidel_sweeps_repeated, line()) {
  RDom r(1, 7, 0, 3);
  f(x) = a(x) * a(x);
  f(r.x) = 0.5f * f(r.x - 1) + 0.25f * f(r.x) + 0.25f * f(r.x + 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(nonlinear_gauss_seidel_in_columns, plane(7, 3)) {
  RDom r(1, 5, 0, 2);
  f(x, y) = a(x, y);
  f(r.x, y) = 0.5f * sin(f(r.x - 1, y)) + 0.25f * f(r.x, y) * f(r.x + 1, y);
  return {weighted_sum(f, {7, 3}), {a}, true};
}

PROGRAM_OF(newton_iterations_in_place, line(5)) {
  RDom r(0, 5);
  f(x) = 1.0f;
  f(x) = 0.5f * (f(x) + a(x) / f(x)) + 0.0f * cast<float>(r);
  return {weighted_sum(f, {5}), {a}, true};
}

PROGRAM(horner) {
  Buffer<float> c = line(6), a = random_image({5}, 0.25, 1, 6);
  Func f("f");
  RDom r(0, 6);
  f(x) = 0.0f;
  f(x) = f(x) * a(x) + c(5 - r);
  return {weighted_sum(f, {5}), {a, c}, true};
}

PROGRAM_OF(running_maximum, line()) {
  RDom r(1, 8);
  f(x) = a(x);
  f(r) = max(f(r), f(r - 1) * 0.9375f);
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM(matrix_power_in_columns) {
  Buffer<float> m = random_image({3, 3}, -1, 1, 12);
  Func v("v");
  RDom r(0, 3, 0, 3, 0, 3);
  v(x, t) = select(t == 0, 1.0f, 0.0f);
  v(r.y, r.z + 1) += m(r.x, r.y) * v(r.x, r.z);
  return {weighted_sum(v, {3, 4}), {m}};
}

PROGRAM_OF(masked_scan, line()) {
  RDom r(1, 8);
  r.where(a(r) > 1.0f);
  f(x) = a(x);
  f(r) = f(r) * 0.5f + f(r - 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM(triangular_solve) {
  Buffer<float> l = random_image({4, 4}, 1, 2, 13), b = line(4);
  Func s("s");
  RDom r(0, 4, 0, 4);
  r.where(r.x < r.y);
  s(x) = b(x);
  s(r.y) -= l(r.x, r.y) * s(r.x);
  return {weighted_sum(s, {4}), {l, b}};
}

// Each row reads its diagonal twice, before and after it is overwritten.
PROGRAM_OF(diagonal_read_twice_while_rows_are_overwritten, random_image({5, 5}, 0.25, 2, 14)) {
  RDom r(0, 3);
  f(x, y) = a(x, y);
  f(r, y) = f(y, y) * 0.0625f + sin(f(y, y));
  return {weighted_sum(f, {5, 5}), {a}, true};
}

}  // namespace
}  // namespace retrograde::gradient
