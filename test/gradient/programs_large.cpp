#include "gradient/programs_large.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), c("c");

Buffer<float> long_line(int n, unsigned seed = 1) { return random_image({n}, 0.25, 2, seed); }
Buffer<float> large_plane(int side, unsigned seed = 2) {
  return random_image({side, side}, 0.25, 2, seed);
}

Program scatter_of_a_line(int side) {
  const int n = side * side;
  Buffer<float> a = long_line(n);
  Buffer<int> at = places(n, 37);
  Func h("h");
  RDom r(0, n);
  h(x) = 0.0f;
  h(clamp(at(r), 0, 36)) += a(r) * a(r);
  return {weighted_sum(h, {37}), {a}};
}

Program lookup_in_a_small_table(int side) {
  const int n = side * side;
  Buffer<float> a = long_line(n), table = line(33);
  Func f("f");
  f(x) = table(clamp(cast<int>(a(x) * 16.0f), 0, 32)) * a(x);
  return {weighted_sum(f, {n}), {a, table}};
}

Program warp_of_a_plane(int side) {
  Buffer<float> a = large_plane(side), flow = random_image({side, side}, 0.25, 3, 5);
  Func f("f");
  Expr u = cast<float>(x) + flow(x, y), i = cast<int>(floor(u)), w = u - floor(u);
  f(x, y) = lerp(a(clamp(i, 0, side - 1), y), a(clamp(i + 1, 0, side - 1), y), w);
  return {weighted_sum(f, {side, side}), {a, flow}};
}

Program warp_in_both_directions(int side) {
  Buffer<float> a = large_plane(side), flow = random_image({side, side}, 0.25, 3, 5);
  Func f("f");
  Expr u = clamp(x + cast<int>(flow(x, y) * 2.0f), 0, side - 1),
       v = clamp(y + cast<int>(flow(y, x) * 3.0f), 0, side - 1);
  f(x, y) = a(u, v) * flow(x, y);
  return {weighted_sum(f, {side, side}), {a, flow}};
}

Program weights_of_a_convolution(int side) {
  Buffer<float> a = large_plane(side), w = random_image({5, 5}, -1, 1, 6);
  Func f("f");
  RDom r(0, 5, 0, 5);
  f(x, y) = 0.0f;
  f(x, y) += a(x + r.x, y + r.y) * w(r.x, r.y);
  return {weighted_sum(f, {side - 4, side - 4}), {a, w}};
}

Program grid_of_a_bilateral_slice(int side) {
  Buffer<float> a = large_plane(side), grid = random_image({8, 8, 6}, -1, 1, 7);
  Func f("f");
  Expr z = clamp(a(x, y) * 2.5f, 0.0f, 4.5f), k = cast<int>(floor(z)), w = z - floor(z);
  f(x, y) = lerp(grid(x * 8 / side, y * 8 / side, k), grid(x * 8 / side, y * 8 / side, k + 1), w) *
            a(x, y);
  return {weighted_sum(f, {side, side}), {a, grid}};
}

Program histogram_in_columns_that_multiplies(int side) {
  Buffer<float> a = random_image({side, side}, 0.875, 1.125, 8);
  Buffer<int> at = places(side, 9);
  Func h("h");
  RDom r(0, side);
  h(x, y) = 1.0f;
  h(clamp(at(r), 0, 8), y) *= a(r, y);
  return {weighted_sum(h, {9, side}), {a}, true};
}

Program scans_of_rows_and_columns(int side) {
  Buffer<float> a = large_plane(side);
  Func f("f");
  RDom r(1, side - 1), q(1, side - 1);
  f(x, y) = a(x, y);
  f(r, y) = 0.5f * f(r, y) + 0.5f * f(r - 1, y);
  f(x, q) = f(x, q) * 0.25f + sin(f(x, q - 1));
  return {weighted_sum(f, {side, side}), {a}};
}

Program largest_of_each_column(int side) {
  Buffer<float> a = large_plane(side);
  Func f("f");
  RDom r(0, side);
  f(x) = maximum(r, a(x, r)) * argmax(r, a(r, x))[1];
  return {weighted_sum(f, {side}), {a}};
}

Program mean_and_variance(int side) {
  Buffer<float> a = large_plane(side);
  Func m("m"), f("f");
  RDom r(0, side, 0, side), q(0, side, 0, side);
  m() = 0.0f;
  m() += a(r.x, r.y) * (1.0f / static_cast<float>(side * side));
  f() = 0.0f;
  f() += (a(q.x, q.y) - m()) * (a(q.x, q.y) - m());
  return {f, {a}};
}

const LargeProgram all[] = {
    {"ScatterOfALine", scatter_of_a_line, 0},  // its gradient is a gather, in vectors
    {"LookupInASmallTable", lookup_in_a_small_table, 32},
    {"WarpOfAPlane", warp_of_a_plane, test_side},
    {"WarpInBothDirections", warp_in_both_directions, 32},
    {"WeightsOfAConvolution", weights_of_a_convolution, 32},
    {"GridOfABilateralSlice", grid_of_a_bilateral_slice, 6},
    {"HistogramInColumnsThatMultiplies", histogram_in_columns_that_multiplies, test_side / 8},
    {"ScansOfRowsAndColumns", scans_of_rows_and_columns, test_side},
    // Less work than a parallel loop takes to start.
    {"LargestOfEachColumn", largest_of_each_column, 0},
    {"MeanAndVariance", mean_and_variance, 0},
};

}  // namespace

std::span<const LargeProgram> large_programs() { return all; }

}  // namespace retrograde::gradient
