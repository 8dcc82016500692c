// Suite programs with loops over time as users write them: recursive filters, simulations, in-place sweeps, state
// machines. The loss reads every output, so that a lost one shows.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), t("t");

// A second-order filter, forward and backward along both axes, as in image processing (I. Young, L. van Vliet,
// Recursive implementation of the Gaussian filter, Signal Processing 44, 1995).
PROGRAM_OF(recursive_filter_of_second_order_along_both_axes, plane(6, 5)) {
  Buffer<float> c = random_image({2}, 0.25, 0.5, 8);
  RDom rx(2, 4), ry(2, 3);
  Expr b0 = 1.0f - c(Expr(0)) + c(Expr(1)) * 0.5f, b1 = c(Expr(0)), b2 = -0.5f * c(Expr(1));
  f(x, y) = a(x, y);
  f(rx, y) = b0 * f(rx, y) + b1 * f(rx - 1, y) + b2 * f(rx - 2, y);
  f(5 - rx, y) = b0 * f(5 - rx, y) + b1 * f(6 - rx, y) + b2 * f(7 - rx, y);
  f(x, ry) = b0 * f(x, ry) + b1 * f(x, ry - 1) + b2 * f(x, ry - 2);
  f(x, 4 - ry) = b0 * f(x, 4 - ry) + b1 * f(x, 5 - ry) + b2 * f(x, 6 - ry);
  return {weighted_sum(f, {6, 5}), {a, c}, true};
}

PROGRAM(recursive_filter_of_third_order_into_another_func) {
  Buffer<float> a = line(12), c = random_image({4}, 0.25, 0.5, 8);
  Func causal("causal"), both("both");
  RDom r(3, 9);
  causal(x) = a(x);
  causal(r) = c(Expr(0)) * a(r) + c(Expr(1)) * causal(r - 1) - c(Expr(2)) * causal(r - 2) +
              0.5f * c(Expr(3)) * causal(r - 3);
  both(x) = causal(x);
  both(11 - r) = c(Expr(0)) * causal(11 - r) + c(Expr(1)) * both(12 - r) -
                 c(Expr(2)) * both(13 - r) + 0.5f * c(Expr(3)) * both(14 - r);
  return {weighted_sum(both, {12}), {a, c}};
}

// The weight of the previous pixel decreases with the step of a guide image (E. Gastal, M. Oliveira, Domain transform
// for edge-aware image and video processing, SIGGRAPH 2011).
PROGRAM(recursive_bilateral_filter) {
  Buffer<float> image = plane(6, 4), guide = plane(6, 4, 5), sigma = line(1, 6);
  Func weight("weight"), f("f");
  RDom r(1, 5);
  weight(x, y) = exp(-abs(guide(x, y) - guide(x - 1, y)) / sigma(Expr(0)));
  f(x, y) = image(x, y);
  f(r, y) = f(r, y) + weight(r, y) * (f(r - 1, y) - f(r, y));
  f(5 - r, y) = f(5 - r, y) + weight(6 - r, y) * (f(6 - r, y) - f(5 - r, y));
  return {weighted_sum(f, {6, 4}), {image, guide, sigma}, true};
}

// Numerator and denominator of a weighted mean, with a data-dependent decay.
PROGRAM_OF(normalised_recursive_mean_in_a_tuple, line()) {
  Buffer<float> w = line(9, 4);
  Func g("g");
  RDom r(1, 8);
  f(x) = Tuple(a(x) * w(x), w(x));
  Expr keep = exp(-w(r));
  f(r) = Tuple(f(r)[0] + keep * f(r - 1)[0], f(r)[1] + keep * f(r - 1)[1]);
  g(x) = f(x)[0] / f(x)[1];
  return {weighted_sum(g, {9}), {a, w}};
}

// Height and velocity of a string on a grid, both kept for every step.
PROGRAM(wave_equation_of_two_states) {
  Buffer<float> start = line(8), speed = line(8, 5);
  Func u("u");
  RDom r(1, 6, 0, 4);
  u(x, t) = Tuple(start(clamp(x, 0, 7)), 0.0f);
  Expr bend = u(r.x - 1, r.y)[0] - 2.0f * u(r.x, r.y)[0] + u(r.x + 1, r.y)[0];
  Expr velocity = u(r.x, r.y)[1] + 0.25f * speed(r.x) * bend;
  u(r.x, r.y + 1) = Tuple(u(r.x, r.y)[0] + 0.25f * velocity, velocity);
  Func g("g");
  g(x, y) = u(x, y)[0] + u(x, y)[1] * u(x, y)[1];
  return {weighted_sum(g, {8, 5}), {start, speed}};
}

PROGRAM(gauss_seidel_sweeps_in_both_directions_over_a_plane) {
  Buffer<float> a = plane(5, 5), f0 = plane(5, 5, 3);
  Func u("u");
  RDom r(1, 3, 1, 3, 0, 2);
  u(x, y) = f0(x, y);
  auto relax = [&](const Expr& i, const Expr& j) {
    u(i, j) = 0.25f * (u(i - 1, j) + u(i + 1, j) + u(i, j - 1) + u(i, j + 1)) -
              0.125f * a(i, j) * u(i, j);
  };
  relax(r.x, r.y);
  relax(4 - r.x, 4 - r.y);
  return {weighted_sum(u, {5, 5}), {a, f0}, true};
}

// A scalar Kalman filter: estimate and variance.
PROGRAM(kalman_filter) {
  Buffer<float> measured = line(), noise = line(2, 4);
  Func k("k"), g("g");
  RDom r(0, 9);
  k(t) = Tuple(0.0f, 1.0f);
  Expr predicted = k(r)[1] + 0.25f * noise(Expr(0)),
       gain = predicted / (predicted + noise(Expr(1)));
  k(r + 1) = Tuple(k(r)[0] + gain * (measured(r) - k(r)[0]), (1.0f - gain) * predicted);
  g(x) = k(x)[0] + k(x)[1];
  return {weighted_sum(g, {10}), {measured, noise}};
}

// A cellular automaton, and an energy that flows between living cells.
PROGRAM(cells_that_live_by_their_neighbours) {
  Buffer<float> start = line(9);
  Func u("u"), g("g");
  RDom r(1, 7, 0, 4);
  u(x, t) = Tuple(cast<int>(start(clamp(x, 0, 8)) > 1.0f), start(clamp(x, 0, 8)));
  auto before = [&](int i) { return u(r.x + i, r.y); };
  Expr alive = before(-1)[0] + before(0)[0] + before(1)[0];
  Expr lives = alive == 1 || alive == 2;
  Expr flow = 0.25f * (before(-1)[1] + before(1)[1]) * before(0)[1];
  u(r.x, r.y + 1) = Tuple(cast<int>(lives), select(lives, flow, 0.5f * before(0)[1]));
  g(x, y) = u(x, y)[1] * cast<float>(1 + u(x, y)[0]);
  return {weighted_sum(g, {9, 5}), {start}};
}

// A recurrent cell with a gate, of three units, all steps kept: hidden(unit, time).
PROGRAM(gated_recurrent_cell) {
  Buffer<float> input = line(5), w = random_image({3, 3}, -1, 1, 5),
                gate = random_image({3}, -1, 1, 6);
  Func h("h");
  RDom r(0, 3, 0, 5);
  h(x, t) = 0.0f;
  Expr sum = input(r.y) * 0.5f;
  for (int i = 0; i < 3; ++i) sum = sum + w(r.x, i) * h(i, r.y);
  Expr open = 1.0f / (1.0f + exp(-(gate(r.x) * input(r.y) + h(r.x, r.y))));
  h(r.x, r.y + 1) = open * h(r.x, r.y) + (1.0f - open) * tanh(sum);
  return {weighted_sum(h, {3, 6}), {input, w, gate}};
}

// Memory and output of a long short-term memory, in a Tuple over (unit, time).
PROGRAM(long_short_term_memory) {
  Buffer<float> input = line(5), w = random_image({2, 4}, -1, 1, 5);
  Func s("s"), out("out");
  RDom r(0, 5);
  s(x, t) = Tuple(0.0f, 0.0f);
  auto sigmoid = [](const Expr& e) { return 1.0f / (1.0f + exp(-e)); };
  Expr memory = s(x, r)[0], last = s(x, r)[1];
  auto drive = [&](int i) { return w(clamp(x, 0, 1), i) * input(r) + 0.5f * last; };
  Expr next = sigmoid(drive(0)) * memory + sigmoid(drive(1)) * tanh(drive(2));
  s(x, r + 1) = Tuple(next, sigmoid(drive(3)) * tanh(next));
  out(x, y) = s(x, y + 1)[1];
  return {weighted_sum(out, {2, 5}), {input, w}};
}

PROGRAM(cumulative_maximum_and_its_place) {
  Buffer<float> a = line(9, 11), b = line(9, 4);
  Func m("m"), g("g");
  RDom r(1, 8);
  m(x) = Tuple(a(x), x);
  m(r) = tuple_select(m(r - 1)[0] > m(r)[0], m(r - 1), m(r));
  g(x) = m(x)[0] * b(clamp(m(x)[1], 0, 8));
  return {weighted_sum(g, {9}), {a, b}, true};
}

// Maximum, sum of exponentials and weighted sum, one key at a time, as in attention over long inputs (M. Milakov, N.
// Gimelshein, Online normalizer calculation for softmax, 2018).
PROGRAM(streaming_softmax) {
  Buffer<float> q = line(3), k = line(7, 4), v = line(7, 5);
  Func s("s"), out("out");
  RDom r(0, 7);
  s(x) = Tuple(-1e30f, 0.0f, 0.0f);
  Expr score = q(clamp(x, 0, 2)) * k(r), top = max(s(x)[0], score);
  Expr old = exp(s(x)[0] - top), now = exp(score - top);
  s(x) = Tuple(top, s(x)[1] * old + now, s(x)[2] * old + now * v(r));
  out(x) = s(x)[2] / s(x)[1];
  return {weighted_sum(out, {3}), {q, k, v}, true};
}

PROGRAM(horner_along_a_time_axis) {
  const int n = 6;
  Buffer<float> c = line(n), a = random_image({5}, 0.25, 1, 6);
  Func f("f"), last("last");
  RDom r(0, n);
  f(x, t) = 0.0f;
  f(x, r + 1) = f(x, r) * a(clamp(x, 0, 4)) + c(n - 1 - r);
  last(x) = f(x, n);
  return {weighted_sum(last, {5}), {a, c}};
}

// Value iteration backward in time, from the last step, choosing the better of two moves.
PROGRAM(value_iteration_backward_in_time) {
  Buffer<float> reward = plane(6, 5), end = line(6, 4);
  Func v("v");
  RDom r(0, 6, 0, 5);
  v(x, t) = end(clamp(x, 0, 5));
  Expr now = 4 - r.y, stay = v(r.x, now + 1), move = v(min(r.x + 1, 5), now + 1) - 0.25f;
  v(r.x, now) = reward(r.x, now) + 0.9375f * max(stay, move);
  return {weighted_sum(v, {6, 6}), {reward, end}};
}

}  // namespace
}  // namespace retrograde::gradient
