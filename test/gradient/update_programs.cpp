// Suite programs whose updates overwrite values, read the values that they overwrite, or write at data-dependent
// indices.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), t("t");

// ---- data-dependent indices ----

PROGRAM(histogram) {
  Buffer<float> a = line(12);
  Buffer<int> at = places(12, 5);
  Func h("h");
  RDom r(0, 12);
  h(x) = 0.0f;
  h(clamp(at(r), 0, 4)) += a(r) * a(r);
  return {weighted_sum(h, {5}), {a}};
}

PROGRAM(histogram_of_a_float_that_chooses_its_bin) {
  Buffer<float> a = line(12);
  Func h("h");
  RDom r(0, 12);
  h(x) = a(x);
  h(clamp(cast<int>(a(r) * 4.0f), 0, 4)) += sin(a(r));
  return {weighted_sum(h, {5}), {a}};
}

PROGRAM(multiplicative_histogram) {
  Buffer<float> a = line(12);
  Buffer<int> at = places(12, 4);
  Func h("h");
  RDom r(0, 12);
  h(x) = 1.0f;
  h(clamp(at(r), 0, 3)) *= a(r);
  return {weighted_sum(h, {4}), {a}, true};
}

PROGRAM(overwriting_histogram) {
  Buffer<float> a = line(12);
  Buffer<int> at = places(12, 5);
  Func h("h");
  RDom r(0, 12);
  h(x) = a(x + 2);
  h(clamp(at(r), 0, 4)) = a(r) * a(r);
  return {weighted_sum(h, {6}), {a}};
}

PROGRAM(decaying_histogram) {
  Buffer<float> a = line(12);
  Buffer<int> at = places(12, 4);
  Func h("h");
  RDom r(0, 12);
  Expr bin = clamp(at(r), 0, 3);
  h(x) = 0.5f * a(x);
  h(bin) = 0.5f * h(bin) + a(r);
  return {weighted_sum(h, {4}), {a}};
}

PROGRAM(nonlinear_histogram_in_pure_columns) {
  Buffer<float> a = plane(7, 6);
  Buffer<int> at = places(7, 3);
  Func h("h");
  RDom r(0, 7);
  Expr bin = clamp(at(r), 0, 2);
  h(x, y) = 0.5f;
  h(bin, y) = h(bin, y) + h(bin, y) * a(r, y) * 0.25f;
  return {weighted_sum(h, {3, 6}), {a}, true};
}

PROGRAM_OF(reads_another_element_at_a_place_of_data, line(8)) {
  Buffer<int> from = places(8, 8);
  RDom r(0, 8);
  f(x) = a(x);
  f(r) = f(r) * 0.5f + f(clamp(from(r), 0, 7)) * 0.25f;
  return {weighted_sum(f, {8}), {a}};
}

PROGRAM_OF(nonlinear_read_at_a_place_of_data, line(8)) {
  Buffer<int> from = places(8, 8);
  RDom r(0, 8);
  f(x) = a(x);
  f(r) = sin(f(clamp(from(r), 0, 7))) * f(r);
  return {weighted_sum(f, {8}), {a}, true};
}

PROGRAM_OF(permutes_by_data, line(6)) {
  Buffer<int> from = places(6, 6), to = places(6, 6, 4);
  RDom r(0, 6);
  f(x) = a(x) * a(x);
  f(clamp(to(r), 0, 5)) = f(clamp(from(r), 0, 5));
  return {weighted_sum(f, {6}), {a}};
}

PROGRAM_OF(place_chosen_by_the_func_itself, line(6)) {
  RDom r(0, 6);
  f(x) = a(x);
  f(clamp(cast<int>(f(r) * 3.0f), 0, 5)) += a(r) * f(r);
  return {weighted_sum(f, {6}), {a}, true};
}

PROGRAM_OF(two_dimensional_scatter_that_overwrites, line(12)) {
  Buffer<int> u = places(12, 3), v = places(12, 4, 5);
  RDom r(0, 12);
  f(x, y) = 0.5f * a(x + y);
  f(clamp(u(r), 0, 2), clamp(v(r), 0, 3)) = a(r) * 2.0f;
  return {weighted_sum(f, {3, 4}), {a}};
}

PROGRAM_OF(masked_by_data_and_overwritten_many_times, line(12)) {
  RDom r(0, 12);
  r.where(a(r) > 1.0f);
  f(x) = a(x);
  f(r / 3) = a(r) * a(r);
  return {weighted_sum(f, {5}), {a}};
}

// ---- moves within one array ----

PROGRAM_OF(swap_of_two_elements, line()) {
  f(x) = Tuple(a(x) * a(x), a(8 - x));
  f(2) = Tuple(f(5)[0], f(2)[1]);
  f(5) = Tuple(f(2)[1], f(5)[0]);
  Func g("g");
  g(x) = f(x)[0] * f(x)[1];
  return {weighted_sum(g, {9}), {a}};
}

PROGRAM_OF(swap_of_tuple_components, line()) {
  Func g("g");
  f(x) = Tuple(a(x) * a(x), sin(a(x)));
  f(x) = Tuple(f(x)[1], f(x)[0]);
  g(x) = f(x)[0] * 3.0f + f(x)[1] * f(x)[1];
  return {weighted_sum(g, {9}), {a}};
}

PROGRAM_OF(reversal_in_place_reads_new_and_old, line(8)) {
  RDom r(0, 8);
  f(x) = a(x) * a(x);
  f(r) = f(7 - r) * 0.5f;
  return {weighted_sum(f, {8}), {a}};
}

PROGRAM_OF(shift_left_in_place, line()) {
  RDom r(0, 7);
  f(x) = a(x) * a(x);
  f(r) = f(r + 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(shift_right_in_place_smears, line()) {
  RDom r(1, 7);
  f(x) = a(x) * a(x);
  f(r) = f(r - 1);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(fold_in_half, line(8)) {
  RDom r(0, 4);
  f(x) = a(x) * a(x);
  f(r) = f(r) + f(7 - r);
  return {weighted_sum(f, {8}), {a}};
}

PROGRAM_OF(tree_of_folds, line(8)) {
  f(x) = a(x) * a(x);
  for (int half = 4; half >= 1; half /= 2) {
    RDom r(0, half);
    f(r) = f(r) + f(r + half) * 0.5f;
  }
  return {weighted_sum(f, {8}), {a}};
}

PROGRAM_OF(tree_of_products, line(8)) {
  f(x) = a(x);
  for (int half = 4; half >= 1; half /= 2) {
    RDom r(0, half);
    f(r) = f(r) * f(r + half);
  }
  return {weighted_sum(f, {8}), {a}, true};
}

PROGRAM_OF(butterflies, line(8)) {
  Func g("g");
  f(x) = a(x);
  g(x) = select(x % 2 == 0, f(x) + f(min(x + 1, 7)), f(max(x - 1, 0)) - f(x));
  return {weighted_sum(g, {8}), {a}};
}

PROGRAM_OF(one_element_rewritten_by_all, line()) {
  RDom r(0, 9);
  f(x) = a(x);
  f(0) = f(0) * 0.5f + a(r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(one_element_rewritten_nonlinearly, line()) {
  RDom r(0, 9);
  f(x) = a(x);
  f(4) = sin(f(4)) + a(r) * f(r);
  return {weighted_sum(f, {9}), {a}, true};
}

// ---- partial overwrites and chains ----

PROGRAM_OF(overwritten_element, line()) {
  f(x) = a(x) * a(x);
  f(3) = a(Expr(0)) * 2.0f;
  f(x) += a(x);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(overwritten_everywhere_gives_nothing_to_the_past, line()) {
  f(x) = a(x) * a(x);
  f(x) = a(8 - x) * 3.0f;
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(every_second_element_overwritten, line()) {
  RDom r(0, 4);
  f(x) = a(x) * a(x);
  f(2 * r + 1) = a(r) * 0.5f;
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(column_and_row_overwritten, plane()) {
  f(x, y) = a(x, y) * a(x, y);
  f(2, y) = a(y, 1);
  f(x, 3) = a(x, 0) * f(x, 2);
  return {weighted_sum(f, {7, 6}), {a}};
}

PROGRAM_OF(chain_of_five_updates, line()) {
  f(x) = a(x);
  f(x) = 2.0f * f(x) + a(8 - x);
  f(x) += a(x) * a(x);
  f(4) = a(Expr(2));
  f(x) = f(x) - 0.5f * a(x);
  f(x) *= 3.0f;
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(old_value_kept_by_select, line()) {
  f(x) = a(x) * a(x);
  f(x) = select(x > 3, f(x), a(x) * 2.0f);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(old_value_kept_by_undef, line()) {
  RDom r(0, 9);
  f(x) = a(x) * a(x);
  f(r) = select(r > 3, 2.0f * a(r), undef<float>());
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(old_tuple_kept_by_undef, line()) {
  Func g("g");
  f(x) = Tuple(a(x) * a(x), sin(a(x)));
  f(x) = select(a(x) > 1.0f, Tuple(undef<float>(), undef<float>()),
                Tuple(a(x) * 3.0f, f(x)[1] + f(x)[0]));
  g(x) = f(x)[0] + 2.0f * f(x)[1];
  return {weighted_sum(g, {9}), {a}};
}

PROGRAM_OF(multiplied_twice, line()) {
  f(x) = a(x);
  f(x) *= a(8 - x);
  f(x) *= a(x);
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM_OF(divided_in_place, line()) {
  f(x) = a(8 - x) + 1.0f;
  f(x) = a(x) / f(x);
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM_OF(value_overwritten_after_it_was_read, line()) {
  f(x) = a(x) * a(x);
  f(8) = f(0) * f(1);
  f(0) = a(Expr(3));
  f(1) = f(0) * f(8);
  return {weighted_sum(f, {9}), {a}, true};
}

PROGRAM_OF(index_of_another_image_from_an_overwritten_value, line()) {
  Buffer<float> table = line(6, 5);
  f(x) = a(x);
  f(x) = table(clamp(cast<int>(f(x) * 3.0f), 0, 5)) * 2.0f;
  return {weighted_sum(f, {9}), {table}, true};
}

PROGRAM_OF(updates_under_a_triangular_predicate, plane(6, 6)) {
  RDom r(0, 6, 0, 6);
  r.where(r.x < r.y);
  f(x, y) = a(x, y) * a(x, y);
  f(r.x, r.y) = a(r.y, r.x) * 0.5f;
  return {weighted_sum(f, {6, 6}), {a}};
}

PROGRAM_OF(overwritten_element_gets_no_gradient_from_before, line()) {
  f(x) = a(x) * a(x);
  f(3) = a(0) * 2.0f;
  f(x) += a(x);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(scan_forward, line()) {
  RDom r(1, 8);
  f(x) = a(x);
  f(r) = f(r) * 0.5f + f(r - 1) * a(r);
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM(recurrence_in_time) {
  Buffer<float> a = line();
  Func u("u");
  RDom r(0, 4);
  u(x, t) = 0.0f;
  u(x, 0) = a(clamp(x, 0, 8));
  u(x, r + 1) = u(x, r) + 0.25f * sin(u(x, r)) * cast<float>(r + 1);
  return {weighted_sum(u, {9, 5}), {a}};
}

PROGRAM(coupled_tuple_recurrence) {
  Buffer<float> a = line();
  Func s("s");
  RDom r(0, 6);
  s(t) = Tuple(0.5f, a(0));
  s(r + 1) = Tuple(s(r)[0] + 0.25f * s(r)[1], s(r)[1] - 0.25f * sin(s(r)[0]) * a(r));
  Func last("last");
  last(x) = s(x)[0] * s(x)[1] + s(x)[1];
  return {weighted_sum(last, {7}), {a}};
}

PROGRAM_OF(masked_overwrite, line()) {
  RDom r(0, 9);
  r.where(a(r) > 1.0f);
  f(x) = a(x) * 2.0f;
  f(r) = a(8 - r) * 3.0f;
  return {weighted_sum(f, {9}), {a}};
}

PROGRAM_OF(update_of_one_column, plane()) {
  f(x, y) = a(x, y);
  f(2, y) += a(1, y) * a(2, y);
  f(x, 3) = 2.0f * f(x, 3);
  return {weighted_sum(f, {7, 6}), {a}};
}

}  // namespace
}  // namespace retrograde::gradient
