// Gradients of programs large enough that private parts, rows and lanes are really run apart: the
// same bits from run to run, on 1, 2, 4 and 8 threads, with iterations taken forward and backward.
// (The small programs of the suite are run so by gradient_check.h.) What the values are is checked
// against the dot product with forward mode.
#include "autodiff/tangents.h"
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x"), y("y"), c("c");

constexpr int n = 1 << 14, side = 160;

Buffer<float> long_line(unsigned seed = 1) { return random_image({n}, 0.25, 2, seed); }
Buffer<float> large_plane(unsigned seed = 2) { return random_image({side, side}, 0.25, 2, seed); }

struct LargeProgram {
  const char* name;
  Program (*build)();
  int least_iterations;  // of the longest parallel loop
};

Program scatter_of_a_line() {
  Buffer<float> a = long_line();
  Buffer<int> at = places(n, 37);
  Func h("h");
  RDom r(0, n);
  h(x) = 0.0f;
  h(clamp(at(r), 0, 36)) += a(r) * a(r);
  return {weighted_sum(h, {37}), {a}};
}

Program lookup_in_a_small_table() {
  Buffer<float> a = long_line(), table = line(33);
  Func f("f");
  f(x) = table(clamp(cast<int>(a(x) * 16.0f), 0, 32)) * a(x);
  return {weighted_sum(f, {n}), {a, table}};
}

Program warp_of_a_plane() {
  Buffer<float> a = large_plane(), flow = random_image({side, side}, 0.25, 3, 5);
  Func f("f");
  Expr u = cast<float>(x) + flow(x, y), i = cast<int>(floor(u)), w = u - floor(u);
  f(x, y) = lerp(a(clamp(i, 0, side - 1), y), a(clamp(i + 1, 0, side - 1), y), w);
  return {weighted_sum(f, {side, side}), {a, flow}};
}

Program warp_in_both_directions() {
  Buffer<float> a = large_plane(), flow = random_image({side, side}, 0.25, 3, 5);
  Func f("f");
  Expr u = clamp(x + cast<int>(flow(x, y) * 2.0f), 0, side - 1),
       v = clamp(y + cast<int>(flow(y, x) * 3.0f), 0, side - 1);
  f(x, y) = a(u, v) * flow(x, y);
  return {weighted_sum(f, {side, side}), {a, flow}};
}

Program weights_of_a_convolution() {
  Buffer<float> a = large_plane(), w = random_image({5, 5}, -1, 1, 6);
  Func f("f");
  RDom r(0, 5, 0, 5);
  f(x, y) = 0.0f;
  f(x, y) += a(x + r.x, y + r.y) * w(r.x, r.y);
  return {weighted_sum(f, {side - 4, side - 4}), {a, w}};
}

Program grid_of_a_bilateral_slice() {
  Buffer<float> a = large_plane(), grid = random_image({8, 8, 6}, -1, 1, 7);
  Func f("f");
  Expr z = clamp(a(x, y) * 2.5f, 0.0f, 4.5f), k = cast<int>(floor(z)), w = z - floor(z);
  f(x, y) = lerp(grid(x / 20, y / 20, k), grid(x / 20, y / 20, k + 1), w) * a(x, y);
  return {weighted_sum(f, {side, side}), {a, grid}};
}

Program histogram_in_columns_that_multiplies() {
  Buffer<float> a = random_image({side, side}, 0.875, 1.125, 8);
  Buffer<int> at = places(side, 9);
  Func h("h");
  RDom r(0, side);
  h(x, y) = 1.0f;
  h(clamp(at(r), 0, 8), y) *= a(r, y);
  return {weighted_sum(h, {9, side}), {a}, true};
}

Program scans_of_rows_and_columns() {
  Buffer<float> a = large_plane();
  Func f("f");
  RDom r(1, side - 1), q(1, side - 1);
  f(x, y) = a(x, y);
  f(r, y) = 0.5f * f(r, y) + 0.5f * f(r - 1, y);
  f(x, q) = f(x, q) * 0.25f + sin(f(x, q - 1));
  return {weighted_sum(f, {side, side}), {a}};
}

Program largest_of_each_column() {
  Buffer<float> a = large_plane();
  Func f("f");
  RDom r(0, side);
  f(x) = maximum(r, a(x, r)) * argmax(r, a(r, x))[1];
  return {weighted_sum(f, {side}), {a}};
}

Program mean_and_variance() {
  Buffer<float> a = large_plane();
  Func m("m"), f("f");
  RDom r(0, side, 0, side), q(0, side, 0, side);
  m() = 0.0f;
  m() += a(r.x, r.y) * (1.0f / (side * side));
  f() = 0.0f;
  f() += (a(q.x, q.y) - m()) * (a(q.x, q.y) - m());
  return {f, {a}};
}

const LargeProgram large_programs[] = {
    {"ScatterOfALine", scatter_of_a_line, 0},  // its gradient is a gather, in vectors
    {"LookupInASmallTable", lookup_in_a_small_table, 32},
    {"WarpOfAPlane", warp_of_a_plane, side},
    {"WarpInBothDirections", warp_in_both_directions, 32},
    {"WeightsOfAConvolution", weights_of_a_convolution, 32},
    {"GridOfABilateralSlice", grid_of_a_bilateral_slice, 6},
    {"HistogramInColumnsThatMultiplies", histogram_in_columns_that_multiplies, side},
    {"ScansOfRowsAndColumns", scans_of_rows_and_columns, side},
    {"LargestOfEachColumn", largest_of_each_column, side},
    {"MeanAndVariance", mean_and_variance, side},
};

struct Outcome {
  std::vector<Buffer<float>> gradients;
  int longest_loop = 0;
};

class LargeGradients : public ::testing::TestWithParam<LargeProgram> {
 protected:
  Program program = GetParam().build();

  Derivative derivative() const {
    AdjointOptions options;
    if (program.store_overwritten) options.overwritten = Overwritten::Store;
    return propagate_adjoints(program.loss, options);
  }
  // All gradients in one call.
  Pipeline pipeline(const Derivative& d) const {
    std::vector<Func> funcs;
    for (const Buffer<float>& input : program.inputs) funcs.push_back(d(input));
    return Pipeline(funcs);
  }
  Outcome run(Pipeline& p, int threads, bool backward) const {
    Outcome result;
    std::vector<Buffer<>> buffers;
    for (const Buffer<float>& input : program.inputs) {
      result.gradients.emplace_back(oracle::region_of(*Buffer<>(input).raw_buffer()).extents);
      buffers.push_back(result.gradients.back());
    }
    OwnThreads context(threads, backward);
    p.realize(&context, Realization(buffers));
    result.longest_loop = context.longest();
    return result;
  }
};

TEST_P(LargeGradients, HaveTheSameBitsOnAnyNumberOfThreads) {
  const Derivative d = derivative();
  Pipeline p = pipeline(d);
  const Outcome first = run(p, 1, false);
  EXPECT_GE(first.longest_loop, GetParam().least_iterations) << "too little runs in parallel";
  for (int threads : {1, 2, 4, 8}) {
    for (bool backward : {false, true}) {
      const Outcome again = run(p, threads, backward);
      for (size_t i = 0; i < first.gradients.size(); ++i) {
        EXPECT_TRUE(same_bits(first.gradients[i], again.gradients[i]))
            << "gradient " << i << " on " << threads << " threads"
            << (backward ? ", backward" : "");
      }
    }
  }
}

// And on the threads of the runtime.
TEST_P(LargeGradients, AgreeWithForwardMode) {
  const Derivative d = derivative();
  Pipeline p = pipeline(d);
  double reverse = 0, scale = 0;
  std::vector<Direction> directions;
  std::vector<Buffer<>> gradients;
  for (const Buffer<float>& input : program.inputs)
    gradients.push_back(Buffer<float>(oracle::region_of(*Buffer<>(input).raw_buffer()).extents));
  p.realize(Realization(gradients));
  for (size_t i = 0; i < gradients.size(); ++i) {
    const Buffer<float> found = gradients[i];
    const oracle::Region region = oracle::region_of(*Buffer<>(found).raw_buffer());
    Buffer<float> v = random_image(region.extents, -1, 1, 50 + static_cast<unsigned>(i));
    directions.emplace_back(program.inputs[i], v);
    v.get()->for_each_element([&](const int* at) {
      const double term = double((*v.get())(at)) * double((*found.get())(at));
      reverse += term;
      scale += std::abs(term);
    });
  }
  Buffer<float> forward = propagate_tangents(program.loss, directions)(program.loss).realize();
  EXPECT_NEAR(double(forward()), reverse, 1e-4 * scale);
}

INSTANTIATE_TEST_SUITE_P(Programs, LargeGradients, ::testing::ValuesIn(large_programs),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace retrograde::gradient
