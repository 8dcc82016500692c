// Suite programs that run over time in a reduction domain: the points of one step are independent of each other. Their
// adjoints run step by step, too.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), t("t");

Expr around(const Func& u, const Expr& i, const Expr& j, const Expr& k) {
  return u(i - 1, j, k) + u(i + 1, j, k) + u(i, j - 1, k) + u(i, j + 1, k);
}
Expr around(const Func& u, const Expr& i, const Expr& j) {
  return u(i - 1, j) + u(i + 1, j) + u(i, j - 1) + u(i, j + 1);
}

PROGRAM(jacobi_iterations_in_one_domain) {
  Buffer<float> start = plane(7, 6);
  Func u("u"), last("last");
  RDom r(1, 5, 1, 4, 1, 3);
  u(x, y, t) = start(x, y);
  u(r.x, r.y, r.z) = 0.25f * around(u, r.x, r.y, r.z - 1);
  last(x, y) = u(x, y, 3);
  return {weighted_sum(last, {7, 6}), {start}};
}

PROGRAM(diffusion_whose_steps_are_all_read) {
  Buffer<float> start = plane(6, 5), rate = random_image({6, 5}, 0.0625, 0.25, 6);
  Func u("u");
  RDom r(1, 4, 1, 3, 0, 3);
  u(x, y, t) = start(clamp(x, 0, 5), clamp(y, 0, 4));
  const Expr here = u(r.x, r.y, r.z);
  u(r.x, r.y, r.z + 1) = here + rate(r.x, r.y) * (around(u, r.x, r.y, r.z) - 4.0f * here) * here;
  return {weighted_sum(u, {6, 5, 4}), {start, rate}};
}

PROGRAM(wave_from_one_source) {
  Buffer<float> speed = random_image({6, 5}, 0.125, 0.25, 6), pulse = line(4);
  Func u("u"), traces("traces");
  RDom r(1, 4, 1, 3, 1, 4);
  u(x, y, t) = 0.0f;
  const Expr here = u(r.x, r.y, r.z);
  u(r.x, r.y, r.z + 1) = 2.0f * here - u(r.x, r.y, r.z - 1) +
                         speed(r.x, r.y) * (around(u, r.x, r.y, r.z) - 4.0f * here) +
                         select(r.x == 3 && r.y == 2, pulse(r.z - 1), 0.0f);
  traces(x, t) = u(x, 1, t + 2);
  return {weighted_sum(traces, {6, 4}), {speed, pulse}};
}

// The first variable counts the steps.
PROGRAM(steps_as_the_innermost_variable) {
  Buffer<float> start = line(7);
  Func u("u"), last("last");
  RDom r(1, 3, 1, 6);
  u(x, t) = start(x);
  u(r.y, r.x) = 0.5f * u(r.y - 1, r.x - 1) * u(r.y, r.x - 1);
  last(x) = u(x, 3);
  return {weighted_sum(last, {7}), {start}};
}

PROGRAM(backward_steps) {
  Buffer<float> start = line(7);
  Func u("u"), first("first");
  RDom r(1, 5, 0, 3);
  u(x, t) = start(x);
  u(r.x, 2 - r.y) = sin(u(r.x - 1, 3 - r.y)) + 0.5f * u(r.x + 1, 3 - r.y);
  first(x) = u(x, 0);
  return {weighted_sum(first, {7}), {start}};
}

// ---- in place ----

PROGRAM(red_black_relaxation) {
  Buffer<float> source = plane(6, 7), relaxation = line(1);
  Func p("p");
  RDom r(1, 4, 1, 5, 0, 2, 0, 2);
  r.where((r.x + r.y) % 2 == r.z);
  p(x, y) = 0.0f;
  const Expr wanted = 0.25f * (around(p, r.x, r.y) - source(r.x, r.y));
  p(r.x, r.y) = p(r.x, r.y) + relaxation(0) * (wanted - p(r.x, r.y));
  return {weighted_sum(p, {6, 7}), {source, relaxation}};
}

PROGRAM(red_black_products_from_an_image) {
  Buffer<float> start = random_image({6, 6}, 0.5, 1.5, 3);
  Func p("p");
  RDom r(1, 4, 1, 4, 0, 2, 0, 2);
  r.where((r.x + r.y) % 2 == r.z);
  p(x, y) = start(x, y);
  p(r.x, r.y) = 0.5f * p(r.x, r.y) + 0.25f * p(r.x - 1, r.y) * p(r.x, r.y + 1);
  return {weighted_sum(p, {6, 6}), {start}, true};
}

// Rows take the row to their left as it was in the last sweep.
PROGRAM(odd_and_even_columns_in_place) {
  Buffer<float> start = plane(6, 4), gain = line(4, 9);
  Func p("p");
  RDom r(0, 2, 0, 4, 0, 2, 0, 2);
  p(x, y) = start(x, y);
  const Expr i = 2 * r.x + 1;
  p(i, r.y) = sin(p(i - 1, r.y)) * gain(r.y) + 0.5f * p(i + 1, r.y) + 0.25f * p(i, r.y);
  return {weighted_sum(p, {6, 4}), {start, gain}};
}

PROGRAM(two_buffers_in_turn) {
  Buffer<float> start = line(7);
  Func u("u"), last("last");
  RDom r(1, 5, 0, 3);
  u(x, t) = start(x);
  u(r.x, (r.y + 1) % 2) = sin(u(r.x - 1, r.y % 2)) + 0.5f * u(r.x + 1, r.y % 2);
  last(x) = u(x, 1);
  return {weighted_sum(last, {7}), {start}, true};
}

}  // namespace
}  // namespace retrograde::gradient
