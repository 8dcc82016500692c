// Tests the default schedule of adjoints without directives, and its interaction with users' directives.
#include "driver/schedule.h"

#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "frontend/language/boundary_conditions.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "support/errors.h"
#include "support/facts.h"
#include "support/schedule_log.h"
#include "transform/read_estimate.h"
#include "transform/size_estimate.h"

namespace retrograde {
namespace {

struct DefaultSchedule : ::testing::Test {
  DefaultSchedule() {
    heavy(x, y) = exp(a(x, y)) * sin(a(x, y)) + cos(a(x, y));
    blur(x, y) = heavy(x, y) * heavy(x + 1, y) + heavy(x, y + 1);
    RDom r(0, 30, 0, 30);
    loss() = 0.0f;
    loss() += blur(r.x, r.y) * blur(r.x, r.y);
  }
  // `f` as it is compiled in the pipeline of `output`.
  static graph::FuncContents scheduled(const Func& output, const Func& f) {
    const auto funcs = graph::topological_order(driver::schedule_unscheduled({output.function()}));
    const auto found = std::find_if(funcs.begin(), funcs.end(),
                                    [&](const graph::FuncPtr& g) { return g->name == f.name(); });
    return found == funcs.end() ? graph::FuncContents() : **found;
  }
  static bool is_stored(const Func& output, const Func& f) {
    return scheduled(output, f).schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
  }

  Buffer<float> a{32, 32};
  Var x{"x"}, y{"y"};
  Func heavy{"heavy"}, blur{"blur"}, loss{"loss"};
};

TEST_F(DefaultSchedule, LeavesPipelinesWithoutAdjointsAlone) {
  EXPECT_EQ(driver::schedule_unscheduled({loss.function()})[0], loss.function());
}

// Deciding takes a good part of the time to compile a long program, so that it happens once.
TEST_F(DefaultSchedule, NothingIsDecidedAgainAfterAutoSchedule) {
  const Func gradient = propagate_adjoints(loss)(a);
  const std::vector<graph::FuncPtr> outputs{loss.function(), gradient.function()};
  EXPECT_NE(driver::schedule_unscheduled(outputs), outputs) << "a copy with directives";
  Pipeline({loss, gradient}).auto_schedule(get_jit_target_from_environment());
  EXPECT_EQ(driver::schedule_unscheduled(outputs), outputs);
}

// A pyramid whose levels each have half the width and height of the one before, put together again. Inlined, f3 would
// be copied 27 times into f0 through the levels in between, and so on.
std::vector<Func> pyramid_of(const Func& image, int levels) {
  Var x("x"), y("y");
  std::vector<Func> down{image}, up;
  for (int i = 1; i < levels; ++i) {
    Func f("down");
    const Func& last = down.back();
    f(x, y) = (last(2 * x - 1, 2 * y) + 2.0f * last(2 * x, 2 * y) + last(2 * x + 1, 2 * y)) / 4.0f;
    down.push_back(f);
  }
  up.push_back(down.back());
  for (int i = levels - 2; i >= 0; --i) {
    Func f("up");
    const Func& last = up.back();
    f(x, y) = (last(x / 2, y / 2) + last((x + 1) / 2, y / 2) + 2.0f * down[i](x, y)) / 4.0f;
    up.push_back(f);
  }
  down.insert(down.end(), up.begin() + 1, up.end());
  return down;
}

struct UnscheduledPyramid : DefaultSchedule {
  UnscheduledPyramid() {
    image(x, y) = a(clamp(x, 0, 31), clamp(y, 0, 31));
    funcs = pyramid_of(image, 7);
    a.for_each_element([&](int i, int j) { a(i, j) = static_cast<float>((7 * i + 13 * j) % 31); });
  }
  size_t stored() const {
    const auto all =
        graph::topological_order(driver::schedule_unscheduled({funcs.back().function()}));
    return std::count_if(all.begin(), all.end(), [](const graph::FuncPtr& f) {
      return f->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
    });
  }

  Func image{"image"};
  std::vector<Func> funcs;
};

TEST_F(UnscheduledPyramid, IsStoredWhereInliningWouldCopyWithoutEnd) {
  EXPECT_GE(stored(), 1u);
  EXPECT_LE(stored(), 6u);
  const Buffer<float> found = funcs.back().realize({32, 32});
  for (Func& f : funcs) f.compute_root();
  const Buffer<float> expected = funcs.back().realize({32, 32});
  expected.for_each_element([&](int i, int j) { EXPECT_FLOAT_EQ(found(i, j), expected(i, j)); });
}

TEST_F(UnscheduledPyramid, OfAFewLevelsIsInlined) {
  funcs = pyramid_of(image, 3);
  EXPECT_EQ(stored(), 0u);
}

TEST_F(UnscheduledPyramid, OfWhichAllIsToBeInlinedIsRefused) {
  funcs = pyramid_of(image, 10);
  for (Func& f : funcs) f.compute_inline();
  expect_error<CompileError>(
      {"cannot inline \"", "that a code generator finishes", "more than 200000", "at root"}, [&] {
        funcs.back().realize({32, 32});
      });
}

// Data-dependent indices have no known region that could be computed in advance.
TEST_F(UnscheduledPyramid, ThatIsReadAnywhereStaysInline) {
  Buffer<int> place(32);
  place.fill(3);
  Func anywhere("anywhere");
  const Func small = pyramid_of(image, 4).back();
  anywhere(x, y) = small(place(x), y) + small(place(x) + 1, y);
  funcs = {anywhere};
  EXPECT_EQ(stored(), 0u);
  const Buffer<float> found = anywhere.realize({32, 4});
  EXPECT_FLOAT_EQ(found(1, 1), found(5, 1));
}

TEST_F(DefaultSchedule, StoresWhatIsReadOftenAndCosts) {
  Derivative d = propagate_adjoints(loss);
  ASSERT_TRUE(is_stored(d(a), heavy));
  const std::vector<graph::Dim> loops = scheduled(d(a), heavy).pure->schedule.dims;
  EXPECT_EQ(loops.front().runs, ForType::Vectorized);
  EXPECT_EQ(heavy.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Inlined)
      << "the Func itself is not changed";
}

TEST_F(DefaultSchedule, ADirectiveOnAFuncSwitchesItOff) {
  Derivative d = propagate_adjoints(loss);
  Func adjoint = d(heavy);
  adjoint.compute_root();
  EXPECT_FALSE(scheduled(d(a), adjoint).pure->schedule.is_given);
}

TEST_F(DefaultSchedule, AHandScheduleOfThePrimalKeepsItsInlinedFuncsInlined) {
  blur.compute_root();
  Derivative d = propagate_adjoints(loss);
  EXPECT_FALSE(is_stored(d(a), heavy));
}

// A warp: in every channel, each pixel reads the four corners of a cell that a flow selects.
struct CornerWarp {
  static constexpr int width = 37, height = 29;
  Buffer<float> image, flow{width, height, 2};
  Var x{"x"}, y{"y"}, c{"c"};
  Func warped{"warped"}, loss{"loss"};

  explicit CornerWarp(int channels) : image(width, height, channels) {
    int seed = 0;
    const auto fill = [&](float& v) { v = static_cast<float>(++seed * 7919 % 1009) / 127 - 4; };
    image.for_each_value(fill);
    flow.for_each_value(fill);
    const Expr u = clamp(x + flow(x, y, 0), 0.0f, width - 1.0f);
    const Expr v = clamp(y + flow(x, y, 1), 0.0f, height - 1.0f);
    const Expr i = min(cast<int>(u), width - 2), j = min(cast<int>(v), height - 2);
    warped(x, y, c) = lerp(lerp(image(i, j, c), image(i + 1, j, c), u - i),
                           lerp(image(i, j + 1, c), image(i + 1, j + 1, c), u - i), v - j);
    RDom r(0, width, 0, height, 0, channels);
    loss() += warped(r.x, r.y, r.z) * (r.x + 2 * r.y - r.z);
  }
  // The expected gradient by the image, summed in double.
  std::vector<double> expected() const {
    std::vector<double> sums(image.number_of_elements());
    const size_t plane = width * height;
    for (int channel = 0; channel < image.channels(); channel++) {
      for (int py = 0; py < height; py++) {
        for (int px = 0; px < width; px++) {
          const double u = std::clamp(px + flow(px, py, 0), 0.0f, width - 1.0f);
          const double v = std::clamp(py + flow(px, py, 1), 0.0f, height - 1.0f);
          const int i = std::min(static_cast<int>(u), width - 2);
          const int j = std::min(static_cast<int>(v), height - 2);
          for (const int corner : {0, 1, 2, 3}) {
            const double across = corner % 2 ? u - i : 1 - (u - i);
            const double down = corner / 2 ? v - j : 1 - (v - j);
            sums[channel * plane + (j + corner / 2) * width + i + corner % 2] +=
                across * down * (px + 2 * py - channel);
          }
        }
      }
    }
    return sums;
  }
};

TEST_F(DefaultSchedule, CornersOfACellAreTapsOfOneScatter) {
  for (const int channels : {1, 3, 4, 17, 24, 70}) {
    SCOPED_TRACE(channels);
    CornerWarp warp(channels);
    Derivative d = propagate_adjoints(warp.loss);
    Func adjoint = d(warp.image);
    size_t scatters = 0;
    for (const graph::FuncPtr& f : graph::topological_order({adjoint.function()})) {
      for (const graph::Definition& update : f->updates)
        scatters += update.rvars.size() > 2 && update.rvars.back().var.rfind("tap", 0) == 0;
    }
    EXPECT_EQ(scatters, 1u);
    const std::vector<double> expected = warp.expected();
    Buffer<float> found = adjoint.realize({CornerWarp::width, CornerWarp::height, channels});
    for (size_t i = 0; i < expected.size(); i++) {
      ASSERT_NEAR(found.data()[i], expected[i], 1e-4 * std::max(std::fabs(expected[i]), 100.0))
          << "element " << i;
    }
  }
}

TEST_F(DefaultSchedule, SizesFollowFromThoseOfTheOutputs) {
  const Buffer<float> image(100, 80);
  Param<int> shift("shift");
  shift.set_estimate(5);
  Func edge("edge"), first("first"), second("second");
  edge(x, y) = image(clamp(x, 0, 99), clamp(y, 0, 79));
  first(x, y) = edge(2 * x, y + shift);
  RDom r(-1, 3);
  second(x, y) = 0.0f;
  second(x, y) += first(x + r, y);
  second.set_estimate(x, 0, 40);
  const transform::SizeEstimate sizes({second.function()});
  EXPECT_EQ(sizes.extent(*second.function(), 0), 40);
  EXPECT_EQ(sizes.extent(*second.function(), 1), std::nullopt);
  EXPECT_EQ(sizes.extent(*first.function(), 0), 42);
  EXPECT_EQ(sizes.extent(*edge.function(), 0), 83);
  EXPECT_EQ(sizes.extent(*edge.function(), 1), std::nullopt);
  second.set_estimate(y, 0, 30);
  EXPECT_EQ(transform::SizeEstimate({second.function()}).extent(*edge.function(), 1), 30);
}

TEST_F(DefaultSchedule, SizesFollowFromThoseOfTheBuffersOfOutputs) {
  const Buffer<float> image(100, 80);
  Func edge("edge"), sums("sums");
  edge(x, y) = image(clamp(x, 0, 99), clamp(y, 0, 79));
  RDom r(-1, 3);
  sums(x, y) += edge(x + r, y);
  sums.output_buffer().dim(0).set_bounds(2, 40);
  edge.output_buffer().dim(1).set_bounds(0, 80);
  const transform::SizeEstimate bound({sums.function()});
  EXPECT_EQ(bound.extent(*sums.function(), 0), 40);
  EXPECT_EQ(bound.extent(*edge.function(), 0), 42);
  EXPECT_EQ(bound.extent(*edge.function(), 1), std::nullopt) << "edge fills no buffer here";
  sums.output_buffer().dim(1).set_estimate(0, 30);
  EXPECT_EQ(transform::SizeEstimate({sums.function()}).extent(*edge.function(), 1), 30);
  sums.set_estimate(y, 0, 20);
  EXPECT_EQ(transform::SizeEstimate({sums.function()}).extent(*edge.function(), 1), 20)
      << "what the Func says comes first";
}

// The number of reads of `read` in the last stage of `reader`.
double reads(const Func& reader, const Func& read) {
  const graph::FuncContents& f = *reader.function();
  const graph::Definition& stage = f.stage(f.stage_count() - 1);
  double total = 0;
  walk(stage, [&](const ir::Call& call) {
    if (call.symbol.raw() == read.function().get())
      total += transform::reads_an_element(call, f, stage);
  });
  return total;
}

TEST_F(DefaultSchedule, KnowsHowOftenAnElementIsRead) {
  Func pointwise("pointwise"), twice("twice"), halves("halves"), up("up"), stencil("stencil"),
      strided("strided"), image_sum("image_sum"), along("along"), clamped("clamped"),
      shifted("shifted"), inside("inside"), parts("parts");
  Var part("part");
  RDom r(0, 5), strip(0, 8), image(0, 30, 0, 40);
  pointwise(x, y) = heavy(y, x + 3);
  twice(x, y) = heavy(x, y) + heavy(x + 1, y);
  halves(x, y) = heavy(2 * x, y) + heavy(2 * x + 1, y);
  up(x, y) = heavy(x / 2, y / 3);
  stencil(x, y) = 0.0f;
  stencil(x, y) += heavy(x - r, y);
  strided(x, y) = 0.0f;
  strided(x, y) += heavy(4 * x + strip, y);
  image_sum() = 0.0f;
  image_sum() += heavy(image.x, image.y);
  along(x) = 0.0f;
  along(x) += heavy(image.x, image.y);
  clamped(x, y) = 0.0f;
  clamped(x, y) += heavy(clamp(likely(x + r), 0, 31), y);
  shifted(x) = 0.0f;
  shifted(x) += heavy(x - image.x + 1, image.x - 5) * heavy(2 * x + image.y, image.y);
  inside(x, y) = 0.0f;
  inside(x, y) += heavy(clamp(x + r, 0, 31) - 3, y);
  EXPECT_EQ(reads(pointwise, heavy), 1);
  EXPECT_EQ(reads(twice, heavy), 2);
  EXPECT_EQ(reads(halves, heavy), 1);
  EXPECT_EQ(reads(up, heavy), 6);
  EXPECT_EQ(reads(stencil, heavy), 5);
  EXPECT_EQ(reads(strided, heavy), 2);
  EXPECT_EQ(reads(image_sum, heavy), 1);
  EXPECT_EQ(reads(along, heavy), 8) << "x has several values";
  EXPECT_EQ(reads(clamped, heavy), 5);
  EXPECT_EQ(reads(shifted, heavy), 40 + 15) << "one index says which, the other loop is idle";
  EXPECT_EQ(reads(inside, heavy), 5);
  parts(x, y, part) = heavy(x, 16 * part + y);
  EXPECT_EQ(reads(parts, heavy), 1) << "y goes over the rows of a part";
}

// A point of a coarse grid sums over the cells around it, a block for each: so many points read the same element.
TEST_F(DefaultSchedule, KnowsThatBlocksReadTheCellsOfTheirNeighbours) {
  Func cells("cells");
  Var block("block");
  const RDom cell(0, 32);
  cells(x, y, block) = 0.0f;
  cells(x, y, block) += heavy(32 * x + cell - 32 * block, y);
  EXPECT_EQ(reads(cells, heavy), 1);
  cells.function()->made = graph::Provenance{.role = graph::Role::Accumulator, .blocks = 1};
  EXPECT_EQ(reads(cells, heavy), 8) << "blocks, of which nothing is known";
}

// A recursive filter in a pipeline with a manual schedule that does not mention it.
TEST_F(DefaultSchedule, AScanIsNotComputedAgainForEachElement) {
  Func scan("scan"), squares("squares"), total("total");
  RDom r(1, 31), all(0, 32, 0, 32);
  scan(x, y) = a(x, y);
  scan(r, y) = 0.25f * scan(r, y) + 0.75f * scan(r - 1, y);
  squares(x, y) = scan(x, y) * scan(x, y);
  squares.compute_root();
  total() = 0.0f;
  total() += squares(all.x, all.y) * squares(all.x, all.y);
  const Derivative d = propagate_adjoints(total);
  EXPECT_TRUE(is_stored(d(a), scan));
  expect_fact(d.costs(), Fact::Performance, scan.name(),
              "without a directive it is computed at root: inside the loops of its consumer its "
              "updates would run again for each element");
}

// At root, a boundary condition has no end that places from data would ask for. Both directions read it, so storing it
// would pay.
TEST_F(DefaultSchedule, ABoundaryConditionReadWhereDataSayStaysInline) {
  std::vector<int> places{-3, 0, 1, 7, 2, 2};
  std::vector<float> values{0.25f, -0.5f, 1.0f};
  Buffer<int> where(places.data(), 6);
  Buffer<float> heights(values.data(), 3);
  Func f("f"), padded("padded"), g("g"), sum("sum");
  f(x) = exp(heights(x));
  padded = BoundaryConditions::repeat_edge(f, {{0, 3}});
  g(x) = sqrt(padded(where(x)) * padded(where(x)) + 0.25f);
  RDom r(0, 6);
  sum() = 0.0f;
  sum() += g(r);
  const Buffer<float> gradient = propagate_adjoints(sum)(heights).realize({3});
  const std::vector<double> readers{2, 1, 3};  // of each height: those beyond the ends read the end
  for (int i = 0; i < 3; ++i) {
    const double value = std::exp(heights(i));
    EXPECT_NEAR(gradient(i), readers[i] * value * value / std::sqrt(value * value + 0.25), 1e-5);
  }
}

TEST_F(DefaultSchedule, AHandScheduleKeepsSmallReductionsThatAreReadOnceInline) {
  Func window("window"), squares("squares"), total("total");
  RDom r(0, 3), all(0, 30, 0, 30);
  window(x, y) = 0.0f;
  window(x, y) += a(x + r, y);
  squares(x, y) = exp(window(x, y));
  squares.compute_root();
  total() = 0.0f;
  total() += squares(all.x, all.y) * squares(all.x, all.y);
  EXPECT_FALSE(is_stored(propagate_adjoints(total)(a), window));
}

// Privatised copies of this warp would take as much memory as 32 images.
TEST(PrivateParts, TakeNoMoreThanABudget) {
  Var x("x"), y("y"), c("c");
  ImageParam image(Float(32), 3, "image"), flow(Float(32), 3, "flow");
  Func warped("warped"), total("total");
  Expr px = clamp(cast<int>(flow(x, y, 0)), 0, 511), py = clamp(cast<int>(flow(x, y, 1)), 0, 511);
  warped(x, y, c) = image(px, py, c) * image(px, py, c);
  RDom r(0, 512, 0, 512, 0, 64);
  total() = 0.0f;
  total() += warped(r.x, r.y, r.z);
  const Derivative d = propagate_adjoints(total, {.wrt = {image}});
  const double image_bytes = 512.0 * 512 * 64 * 4;  // the gradient, and twice that for its sums
  ASSERT_TRUE(d.operations().gradient.bytes().value().has_value());
  EXPECT_LE(*d.operations().gradient.bytes().value(), 3.1 * image_bytes) << d.explain(Detail::All);
}

TEST(PrivateParts, AreFewerForLargeTargets) {
  Var x("x"), y("y");
  const auto explained = [&](int side) {
    ImageParam image(Float(32), 2, "photograph"), flow(Float(32), 3, "flow");
    Func warped("warped"), total("total");
    warped(x, y) = image(clamp(cast<int>(flow(x, y, 0)), 0, side - 1),
                         clamp(cast<int>(flow(x, y, 1)), 0, side - 1));
    RDom r(0, 4 * side, 0, 4 * side);
    total() = 0.0f;
    total() += warped(r.x, r.y) * warped(r.x, r.y);
    return propagate_adjoints(total, {.wrt = {image}}).explanations();
  };
  expect_fact(
      explained(256), Fact::Performance, "photograph",
      "\"photograph_adj\": accumulated in 32 privatised copies of 524288 bytes each, as many as "
      "fit 67108864 bytes");
  expect_fact(
      explained(1024), Fact::Performance, "photograph",
      "\"photograph_adj\": accumulated in 8 privatised copies of 8388608 bytes each, as many as "
      "fit 67108864 bytes");
}

// The number of copies that fit is known when the pipeline runs; bits are the same on any number of threads.
TEST(PrivateParts, OfSizesKnownAtRunTime) {
  Var x("x");
  ImageParam image(Float(32), 1, "image"), place(Int(32), 1, "place");
  Func read("read"), total("total");
  read(x) = image(clamp(place(x), 0, image.width() - 1));
  RDom r(0, place.width());
  total() = 0.0f;
  total() += read(r) * read(r) * cast<float>(r % 7);
  const Derivative d = propagate_adjoints(total, {.wrt = {image}});
  expect_fact(
      d.explanations(), Fact::Performance, image.name(),
      "\"image_adj\": accumulated in at most 32 privatised copies, as many as fit 67108864 bytes");
  Buffer<float> values(37), expected(37);
  Buffer<int> places(5000);
  for (int i = 0; i < 37; ++i) values(i) = 0.25f * static_cast<float>(i - 18);
  expected.fill(0.0f);
  for (int i = 0; i < 5000; ++i) {
    places(i) = i * i % 37;
    expected(places(i)) += 2.0f * values(places(i)) * static_cast<float>(i % 7);
  }
  image.set(values);
  place.set(places);
  Func by_image = d(image);
  const oracle::Region region{{0}, {37}};
  const Buffer<float> found = gradient::run_on_threads(by_image, region, 1, false);
  for (int i = 0; i < 37; ++i)
    EXPECT_NEAR(found(i), expected(i), 1e-3f * (1 + std::abs(expected(i))));
  for (int threads : {2, 4})
    EXPECT_TRUE(gradient::same_bits(
        found, gradient::run_on_threads(by_image, region, threads, threads == 4)));
}

}  // namespace
}  // namespace retrograde
