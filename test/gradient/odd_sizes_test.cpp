// Tests typical image programs at sizes that no vector length divides: no schedule that the compiler chooses may read
// more than the program and its gradient need.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "frontend/language/inline_reductions.h"
#include "support/checked_accesses.h"
#include "support/program_counts.h"
#include "testing/interpreter.h"
#include "testing/programs/program.h"

namespace retrograde::gradient {
namespace {

constexpr uint64_t first_program = 0, program_count = many_or_few(200, 5);

// The budget of interpreter operations for one program.
constexpr uint64_t operations = 20'000'000;

// The largest difference, relative to the largest element.
double largest_difference(const Func& gradient, const Buffer<float>& found) {
  const oracle::Region region = oracle::region_of(*found.raw_buffer());
  const oracle::Array expected = oracle::Interpreter({.widen = true, .max_operations = operations})
                                     .realize(gradient.function(), region)
                                     .front();
  double worst = 0, scale = 1e-3;
  region.for_each([&](const std::vector<int>& at) {
    const double e = expected.at(at).scalar.as_double();
    scale = std::max(scale, std::fabs(e));
    worst = std::max(worst, std::fabs(e - found.get()->operator()(at.data())));
  });
  return worst / scale;
}

// Checks the value, then the gradients by image and scale under the compiler's schedule, against the interpreter in
// double. Returns an error, or an empty string if all run and are right.
std::string check(const fuzz::RandomProgram& program) {
  const std::vector<int>& size = program.region().extents;
  const RDom all(0, size[0], 0, size[1]);
  const Expr v = program.output()(all.x, all.y);
  Func loss("loss");
  loss() = 0.0f;
  loss() += v * v * 0.01f;
  for (Func f : program.roots) f.compute_root();
  std::string doing = "value";
  try {
    loss.realize();
    doing = "derivative";
    const Derivative d = propagate_adjoints(loss, {.overwritten = Overwritten::Store});
    const Buffer<>& image = program.images[0];
    doing = "gradient by the image";
    Func by_image = d(image), by_scale = d(program.scale);
    Buffer<float> found = by_image.realize({image.dim(0).extent(), image.dim(1).extent()});
    doing = "gradient by the scale";
    if (by_scale.defined()) by_scale.realize();
    doing = "interpreter";
    const double off = largest_difference(by_image, found);
    return off <= 2e-3 ? "" : "gradient off by " + std::to_string(off);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    if (doing == "interpreter" && what.find("operations") != std::string::npos) return "";
    return doing + ": " + what;
  }
}

TEST(OddSizes, ValuesAndGradientsRunAndAreRight) {
  for (uint64_t seed = first_program; seed < first_program + program_count; ++seed) {
    fuzz::Choices choices(seed);
    const fuzz::RandomProgram program = fuzz::make_program(choices, fuzz::Style::pieces());
    const std::string text = fuzz::to_text(program);
    EXPECT_EQ(check(program), "") << seed << ":\n" << text;
  }
}

// The window of a filter element moves with the element. Its end and its offset add up to the image's end.
TEST(OddSizes, WindowsOverImagesWithBoundariesReadNothingOutside) {
  using Bounded = Func (*)(const ImageParam&);
  const std::map<std::string, Bounded> boundaries = {
      {"mirror_image", [](const ImageParam& i) { return BoundaryConditions::mirror_image(i); }},
      {"mirror_interior",
       [](const ImageParam& i) { return BoundaryConditions::mirror_interior(i); }},
      {"repeat_image", [](const ImageParam& i) { return BoundaryConditions::repeat_image(i); }},
      {"repeat_edge", [](const ImageParam& i) { return BoundaryConditions::repeat_edge(i); }},
      {"constant",
       [](const ImageParam& i) { return BoundaryConditions::constant_exterior(i, 1.0f); }}};
  Buffer<float> pixels(20, 33, 1), weights(5, 3);
  pixels.fill(
      [](int x, int y, int c) { return std::sin(static_cast<float>(x + 3 * y * y + 7 * c)); });
  weights.fill([](int x, int y) { return 0.25f * static_cast<float>(x - y) + 0.125f; });
  Var x("x"), y("y"), c("c");
  for (const auto& [name, bounded] : boundaries) {
    for (const int begin : {0, -1}) {
      ImageParam image(Float(32), 3, "image"), filter(Float(32), 2, "filter");
      image.set(pixels);
      filter.set(weights);
      RDom window(begin, 5, begin, 3), all(image);
      Func f("f"), loss("loss");
      f(x, y, c) = 0.0f;
      f(x, y, c) += bounded(image)(x + window.x, y + window.y, c) *
                    filter(window.x - begin, window.y - begin);
      loss() = 0.0f;
      loss() += f(all.x, all.y, all.z) * f(all.x, all.y, all.z);
      const Derivative d = propagate_adjoints(loss);
      EXPECT_LE(largest_difference(d(filter), d(filter).realize({5, 3})), 1e-4)
          << name << " from " << begin;
      EXPECT_LE(largest_difference(d(image), d(image).realize({20, 33, 1})), 1e-4)
          << name << " from " << begin;
    }
  }
}

// The gain's gradient is summed in vectors of 16 lanes, which leave a tail of two out of 30. Its privatised copies
// recompute the position of the minimum.
TEST(OddSizes, PrivatePartsComputeAgainNoMoreThanTheirDomainHas) {
  constexpr int n = 30, taps = 5;
  Buffer<float> image(n + taps - 1, n);
  image.fill(0.5f);
  Param<float> gain("gain");
  gain.set(0.75f);
  Var x("x"), y("y");
  RDom r(0, taps), all(0, n, 0, n);
  Func f("f"), loss("loss");
  f(x, y) = argmin(r, image(x + r, y))[1] * gain;
  f.compute_root();
  loss() = 0.0f;
  loss() += f(all.x, all.y) * f(all.x, all.y);
  Buffer<float> by_gain = propagate_adjoints(loss)(gain).realize();
  EXPECT_NEAR(by_gain(), 2 * 0.75f * 0.25f * n * n, 1e-3);
}

// Indices are clamped into domains, but an empty domain has no last element.
TEST(OddSizes, AReductionOfRunTimeExtentZeroHasAGradientOfZero) {
  Buffer<float> image(24);
  image.fill(0.5f);
  Param<int> count("count");
  Param<float> gain("gain");
  gain.set(0.75f);
  Var x("x");
  RDom r(0, count);
  Func f("f"), of_image("of_image"), of_func("of_func"), of_sum("of_sum");
  f(x) = image(x) * gain;
  f.compute_root();
  of_image() = gain;
  of_image() += image(r) * image(r) * gain;
  of_func() = gain;
  of_func() += f(r) * f(r);
  of_sum() = gain + sum(r, image(r) * gain);
  for (const Func& loss : {of_image, of_func, of_sum}) {
    const Derivative d = propagate_adjoints(loss);
    Func by_image = d(image), by_gain = d(gain);
    for (int n : {0, 3}) {
      count.set(n);
      Buffer<float> slopes = by_image.realize({24}), slope = by_gain.realize();
      EXPECT_EQ(slopes(0) != 0, n > 0) << loss.name() << " of " << n;
      EXPECT_EQ(slopes(3), 0);
      EXPECT_EQ(slope() != 1, n > 0) << loss.name() << " of " << n;
    }
  }
}

// The update reads the element beside its own, but it never runs: the gradient reads no index that the program leaves
// out.
TEST(OddSizes, UpdatesOverEmptyDomainsNeedNoElements) {
  ImageParam image(Float(32), 1, "image");
  Buffer<float> values(5);
  Buffer<int> indices(1);
  values.fill(0.5f);
  indices.fill(2);
  image.set(values);
  Var x("x");
  RDom r(1, 0);
  Func picked("picked"), state("state"), out("out");
  picked(x) = image(clamp(indices(x), 0, 4)) * image(clamp(indices(x), 0, 4));
  state(x) = picked(x);
  state(r) = state(r + 1) * 0.5f;
  out() = state(0);
  const Buffer<float> found = propagate_adjoints(out)(image).realize({5});
  for (int i = 0; i < 5; ++i) EXPECT_EQ(found(i), i == 2 ? 1.0f : 0.0f) << i;
}

// One compiled gradient serves seeds of every size. It must not read a row more than the seed has, although bounds of
// rows and taps taken separately would allow it.
TEST(OddSizes, AConvolutionsGradientReadsASeedOfRunTimeSizeWhereItIs) {
  constexpr int taps = 3;
  ImageParam image(Float(32), 3, "image"), filter(Float(32), 4, "filter"),
      seed(Float(32), 3, "seed");
  Var x("x"), y("y"), c("c");
  for (const int apart : {1, 2}) {
    RDom r(0, taps, 0, taps, 0, filter.dim(2).extent());
    Func f("f");
    f(x, y, c) = 0.0f;
    f(x, y, c) += filter(r.x, r.y, r.z, c) * image(x + apart * r.x, y + apart * r.y, r.z);
    Region bounds;
    for (int d = 0; d < 3; ++d) bounds.push_back({seed.dim(d).min(), seed.dim(d).extent()});
    Func by_image = propagate_adjoints(f, Func(seed), bounds)(image);
    for (const auto& [width, height, from, to] :
         std::vector<std::array<int, 4>>{{20, 17, 5, 4}, {1, 3, 1, 2}}) {
      const int wide = width + apart * (taps - 1), high = height + apart * (taps - 1);
      Buffer<float> in(wide, high, from), weights(taps, taps, from, to), slopes(width, height, to);
      in.fill(0.5f);
      weights.for_each_element([&](int i, int j, int k, int l) {
        weights(i, j, k, l) = 1 + i + 0.5f * j - k + 0.25f * l;
      });
      slopes.for_each_element(
          [&](int i, int j, int l) { slopes(i, j, l) = 0.125f * ((7 * i + 5 * j + 3 * l) % 11); });
      image.set(in);
      filter.set(weights);
      seed.set(slopes);
      const Buffer<float> found = by_image.realize({wide, high, from});
      Buffer<double> expected(wide, high, from);
      expected.fill(0);
      weights.for_each_element([&](int i, int j, int k, int l) {
        for (int v = 0; v < height; ++v)
          for (int u = 0; u < width; ++u)
            expected(u + apart * i, v + apart * j, k) +=
                static_cast<double>(weights(i, j, k, l)) * slopes(u, v, l);
      });
      expected.for_each_element([&](int u, int v, int k) {
        ASSERT_NEAR(found(u, v, k), expected(u, v, k), 1e-4)
            << u << ", " << v << ", " << k << " of " << width;
      });
    }
  }
}

}  // namespace
}  // namespace retrograde::gradient
