// Suite programs about access patterns: structured indices, boundary conditions, resampling.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), c("c");

// A nonlinear loss, so that the point at which a partial is evaluated shows, too.
Program squared(const Func& f, const std::vector<int>& sizes, const Buffer<float>& input) {
  return {weighted_sum(f, sizes), {input}};
}

PROGRAM_OF(chain_of_stencils, line()) {
  Func g("g"), h("h");
  f(x) = a(x) * 1.5f;
  g(x) = f(x) * f(x + 1) - f(x + 2);
  h(x) = g(x) + g(x + 2) * g(x + 1);
  return squared(h, {5}, a);
}

PROGRAM_OF(strided_and_dilated_reads, line(20)) {
  f(x) = a(3 * x) * a(2 * x + 5) + a(x + 4);
  return squared(f, {6}, a);
}

PROGRAM_OF(divided_and_wrapped_reads, line()) {
  f(x) = a(x / 3) * a((x + 5) % 4) + a(x % 2 + x / 4);
  return squared(f, {12}, a);
}

PROGRAM_OF(upsampling_by_interpolation, line(6)) {
  Expr w = cast<float>(x % 2) * 0.5f;
  f(x) = a(x / 2) * (1.0f - w) + a(x / 2 + 1) * w;
  return squared(f, {10}, a);
}

PROGRAM_OF(bilinear_resize, plane()) {
  auto at = [](const Expr& v, int n) { return clamp(v, 0, n - 1); };
  Expr u = cast<float>(x) * 0.5f, v = cast<float>(y) * 0.75f;
  Expr iu = cast<int>(floor(u)), iv = cast<int>(floor(v)), wu = u - floor(u), wv = v - floor(v);
  f(x, y) = lerp(lerp(a(at(iu, 7), at(iv, 6)), a(at(iu + 1, 7), at(iv, 6)), wu),
                 lerp(a(at(iu, 7), at(iv + 1, 6)), a(at(iu + 1, 7), at(iv + 1, 6)), wu), wv);
  return squared(f, {10, 6}, a);
}

PROGRAM_OF(warp_by_a_learned_flow, line(9)) {
  Buffer<float> flow = random_image({6}, 0.25, 2, 14);
  Expr u = cast<float>(x) + flow(x), i = cast<int>(floor(u)), w = u - floor(u);
  f(x) = lerp(a(clamp(i, 0, 8)), a(clamp(i + 1, 0, 8)), w);
  return {weighted_sum(f, {6}), {a, flow}};
}

PROGRAM_OF(rotation_and_transpose, plane(6, 6)) {
  f(x, y) = a(y, 5 - x) * a(x, y) + a(y, x);
  return squared(f, {6, 6}, a);
}

PROGRAM_OF(shear, plane(9, 6)) {
  f(x, y) = a(x + y, y) * a(x, 5 - y) + a(x + 2, x / 2 + y / 3);
  return squared(f, {4, 5}, a);
}

PROGRAM_OF(diagonals, plane(6, 6)) {
  f(x) = a(x, x) * a(x, 5 - x) + a(x, (x + 1) % 6);
  return squared(f, {6}, a);
}

PROGRAM(diagonal_of_a_matrix_of_funcs) {
  Buffer<float> a = plane(6, 6);
  Func m("m"), f("f");
  m(x, y) = a(x, y) * a(y, x);
  f(x) = m(x, x);
  return squared(f, {6}, a);
}

// Only the second index determines x: the first one says x = e0 - (a truth value of x).
PROGRAM_OF(diagonal_that_a_condition_bends, plane(7, 6)) {
  f(x) = a(x + cast<int>(x == 0), x);
  return squared(f, {6}, a);
}

PROGRAM_OF(toeplitz, line(9)) {
  f(x, y) = a(x - y + 4);
  return squared(f, {5, 5}, a);
}

PROGRAM_OF(hankel, line(9)) {
  f(x, y) = a(x + y);
  return squared(f, {5, 5}, a);
}

PROGRAM_OF(symmetric_matrix_from_its_half, plane(5, 5)) {
  f(x, y) = a(min(x, y), max(x, y));
  return squared(f, {5, 5}, a);
}

PROGRAM_OF(pixel_shuffle_and_back, plane(12, 4)) {
  Func g("g");
  f(x, y, c) = a(4 * x + c, y) * a(4 * x + c, y);
  g(x, y) = f(x / 4, y, x % 4) * 0.5f;
  return squared(g, {12, 4}, a);
}

PROGRAM_OF(bayer_mosaic, random_image({4, 3, 4}, 0.25, 2, 15)) {
  f(x, y) = a(x / 2, y / 2, x % 2 + 2 * (y % 2));
  return squared(f, {8, 6}, a);
}

PROGRAM_OF(channels_by_mux, line()) {
  Buffer<float> b = line(9, 4);
  f(x, c) = mux(c, {a(x) * 2.0f, b(x), a(x) * b(8 - x)});
  return {weighted_sum(f, {9, 3}), {a, b}};
}

PROGRAM_OF(piecewise_index, line(12)) {
  f(x) = a(clamp(select(x < 5, x + 5, 9 - x), 0, 11));
  return squared(f, {10}, a);
}

PROGRAM_OF(absolute_difference_as_an_index, line()) {
  f(x, y) = a(clamp(cast<int>(abs(x - y)), 0, 8));
  return squared(f, {6, 6}, a);
}

PROGRAM_OF(clamped_window, line(6)) {
  RDom r(-3, 7);
  f(x) = 0.0f;
  f(x) += a(clamp(x + r, 0, 5)) * cast<float>(r + 4);
  return squared(f, {6}, a);
}

template <typename Bound>
Program blurred(const Bound& bounded, const Buffer<float>& a) {
  Func f("f");
  f(x, y) = bounded(x - 2, y) * 0.5f + bounded(x + 1, y - 1) * bounded(x, y + 2);
  return {weighted_sum(f, {7, 6}), {a}};
}
PROGRAM(border_repeat_edge) {
  Buffer<float> a = plane();
  return blurred(BoundaryConditions::repeat_edge(a), a);
}
PROGRAM(border_constant) {
  Buffer<float> a = plane();
  return blurred(BoundaryConditions::constant_exterior(a, 0.5f), a);
}
PROGRAM(border_repeat_image) {
  Buffer<float> a = plane();
  return blurred(BoundaryConditions::repeat_image(a), a);
}
PROGRAM(border_mirror_image) {
  Buffer<float> a = plane();
  return blurred(BoundaryConditions::mirror_image(a), a);
}
PROGRAM(border_mirror_interior) {
  Buffer<float> a = plane();
  return blurred(BoundaryConditions::mirror_interior(a), a);
}

PROGRAM_OF(place_shifted_by_data_of_the_row, plane(9, 5)) {
  Buffer<int> shift = places(5, 4);
  f(x, y) = a(x + clamp(shift(y), 0, 3), y);
  return squared(f, {6, 5}, a);
}

PROGRAM(lookup_by_data) {
  Buffer<float> table = line(5);
  Buffer<int> index = places(12, 5);
  Func f("f");
  f(x) = table(clamp(index(x), 0, 4)) * cast<float>(x + 1);
  return squared(f, {12}, table);
}

PROGRAM(lookup_by_data_in_pure_rows) {
  Buffer<float> table = plane(5, 4);
  Buffer<int> index = places(9, 5);
  Func f("f");
  f(x, y) = table(clamp(index(x), 0, 4), y);
  return squared(f, {9, 4}, table);
}

PROGRAM(pyramid_down_and_up) {
  Buffer<float> a = line(16);
  Func down("down"), up("up"), f("f");
  down(x) = 0.25f * a(2 * x) + 0.5f * a(2 * x + 1) + 0.25f * a(clamp(2 * x + 2, 0, 15));
  up(x) = 0.5f * down(x / 2) + 0.5f * down((x + 1) / 2);
  f(x) = a(x) - up(x) * up(x);
  return squared(f, {14}, a);
}

PROGRAM(haar_wavelet_and_back) {
  Buffer<float> a = line(12);
  Func w("w"), v("v");
  w(x, c) = mux(c, {a(2 * x) + a(2 * x + 1), a(2 * x) - a(2 * x + 1)});
  v(x) = select(x % 2 == 0, w(x / 2, 0) * w(x / 2, 1), w(x / 2, 0) - w(x / 2, 1));
  return squared(v, {12}, a);
}

PROGRAM_OF(convolution_with_learned_kernel, line()) {
  Buffer<float> kernel = random_image({3}, -1, 1, 7);
  RDom r(0, 3);
  f(x) = 0.0f;
  f(x) += a(x + r) * kernel(r);
  return {weighted_sum(f, {7}), {a, kernel}};
}

PROGRAM(strided_convolution_and_upsampling) {
  Buffer<float> a = line();
  Buffer<float> kernel = random_image({3}, -1, 1, 7);
  Func down("down"), up("up");
  RDom r(0, 3);
  down(x) = sum(a(2 * x + r) * kernel(r));
  up(x) = down(x / 2) * (0.5f + cast<float>(x % 2));
  return {weighted_sum(up, {8}), {a, kernel}};
}

PROGRAM(histogram_of_data_dependent_places) {
  Buffer<float> a = plane();
  Func h("h");
  RDom r(0, 7, 0, 6);
  h(x) = 0.0f;
  h(clamp(cast<int>(a(r.x, r.y) * 4.0f), 0, 7)) += a(r.x, r.y) * a(r.x, r.y);
  return {weighted_sum(h, {8}), {a}};
}

PROGRAM_OF(lookup_table_at_data_dependent_place, line()) {
  Buffer<float> table = random_image({8}, 0.25, 2, 3);
  Expr u = a(x) * 3.0f;
  Expr cell = clamp(cast<int>(floor(u)), 0, 6);
  Expr w = u - cast<float>(cell);
  f(x) = lerp(table(cell), table(cell + 1), w);
  return {weighted_sum(f, {9}), {table, a}};
}

}  // namespace
}  // namespace retrograde::gradient
