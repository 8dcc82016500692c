// Suite programs on which published systems for automatic differentiation give wrong values, silent failures, or values
// that are not finite.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y");

// The branch that is not taken would give 0 * infinity.
PROGRAM_OF(select_whose_other_branch_has_an_infinite_partial, line()) {
  a(3) = 0.0f;
  f(x) = select(a(x) > 0.125f, sqrt(a(x)), 2.0f * a(x));
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM(select_whose_other_branch_is_nan_in_a_func_of_its_own) {
  Buffer<float> a = random_image({9}, -2, 2, 4);
  Func root("root"), f("f");
  root(x) = log(a(x)) * sqrt(a(x));
  f(x) = select(a(x) > 0.0f, root(x), a(x));
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(division_guarded_by_select, line()) {
  a(4) = 0.0f;
  f(x) = select(a(x) == 0.0f, 1.0f, sin(a(x)) / a(x));
  return {weighted_sum(f, {4}), {a}};
}

PROGRAM_OF(diagonal_read_twice, plane(6, 6)) {
  Func g("g");
  f(x, y) = a(x, y) * a(x, y);
  g(x) = f(x, x) * f(x, x) + f(x, 0);
  return {weighted_sum(g, {6}), {a}};
}

PROGRAM_OF(read_then_overwrite, line()) {
  Func g("g");
  f(x) = a(x) * a(x);
  f(2) = f(2) * 3.0f + f(4);
  f(4) = a(7);
  g(x) = f(x) * f(8 - x);
  return {weighted_sum(g, {9}), {a}};
}

PROGRAM_OF(shifted_read_after_write, line()) {
  RDom r(0, 8);
  f(x) = a(x) * a(x);
  f(r + 1) = f(r) * 0.5f + a(r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(shifted_read_before_write, line()) {
  RDom r(0, 8);
  f(x) = a(x) * a(x);
  f(r) = f(r + 1) * 0.5f + a(r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(in_place_product, line()) {
  f(x) = a(x) + 1.0f;
  f(x) = f(x) * f(x) * a(x);
  f(x) += f(x) * f(x);
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM_OF(in_place_normalisation, line()) {
  RDom r(0, 9);
  f(x) = a(x);
  f(r) = f(r) / (f(0) + f(8));
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM_OF(gradient_that_cancels_to_zero, line()) {
  f(x) = (a(x) - a(8 - x)) + (a(8 - x) - a(x));
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(gradient_that_rounding_stops, line()) {
  f(x) = floor(a(x) * 4.0f) + round(a(x) * 2.0f - 0.25f) + ceil(a(x) * 8.0f);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(scan_that_reads_its_own_end, line()) {
  Func g("g");
  RDom r(1, 8);
  f(x) = a(x);
  f(r) = f(r - 1) * 0.5f + f(r);
  g(x) = f(x) * f(8) + f(0);
  return {weighted_sum(g, {9}), {a}};
}

PROGRAM(same_func_read_by_two_scans) {
  Buffer<float> a = line();
  Func b("b"), f("f"), g("g"), h("h");
  RDom r(1, 8);
  b(x) = a(x) * a(x);
  f(x) = b(x);
  f(r) += f(r - 1) * 0.5f;
  g(x) = b(8 - x);
  g(r) += g(r - 1) * b(r);
  h(x) = f(x) * g(x);
  return {weighted_sum(h, {9}), {a}};
}

PROGRAM_OF(many_writers_of_one_element, line()) {
  RDom r(0, 5);
  f(x) = a(x);
  f(2) = a(r) * a(r);
  return {weighted_sum(f, {9}), {a}};
}

// Nothing reads row 0, although a tape runs the update there backward.
PROGRAM(infinite_factor_where_nothing_is_read) {
  Buffer<float> a = line(), scale = line(1);
  Buffer<int> row = places(2, 1);
  Func big("big"), f("f"), g("g");
  RDom r(0, 2);
  big() = -std::numeric_limits<float>::infinity();
  f(x, y) = sin(a(x));
  f(r, clamp(row(r), 0, 4)) *= big() * scale(Expr(0));
  g(x) = f(x, 1);
  return {weighted_sum(g, {9}), {a}, true};
}

PROGRAM_OF(gather_of_integers_that_were_floats, line()) {
  Buffer<float> b = line(9, 6);
  f(x) = b(clamp(cast<int>(a(x) * 4.0f), 0, 8)) * a(x);
  return {weighted_sum(f, {9}), {a, b}};
}

}  // namespace
}  // namespace retrograde::gradient
