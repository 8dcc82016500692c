// Recurrences along two variables run in wavefronts: which do, their loops, and their results and gradients against the
// interpreter and on several threads.
#include "transform/wavefronts.h"

#include <gtest/gtest.h>

#include "driver/schedule.h"
#include "frontend/data/image_param.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "graph/graph.h"
#include "graph/names.h"

namespace retrograde {
namespace {

using gradient::random_image;
using graph::FuncPtr;

// The loops of an update, outermost first, without the parts of split ones.
std::string loops_in_order(const graph::FuncContents& f, size_t update = 0) {
  std::string result;
  const auto& schedule = f.updates.at(update).schedule;
  for (auto loop = schedule.dims.rbegin(); loop != schedule.dims.rend(); ++loop) {
    const bool is_part = std::ranges::any_of(
        schedule.splits, [&](const graph::Split& split) { return split.inner == loop->var; });
    if (!is_part) result += (result.empty() ? "" : " ") + graph::without_numbers(loop->var);
  }
  return result;
}

// A copy of the program that runs in wavefronts, with its schedule.
Func in_wavefronts(const Func& f) {
  const std::vector<FuncPtr> copy = graph::copy_graph({f.function()}).outputs;
  const bool has_some = transform::has_wavefronts(copy);
  transform::run_in_wavefronts(copy);
  EXPECT_EQ(has_some, copy[0]->updates.empty() ||
                          copy[0]->updates[0].rvars.size() != f.function()->updates[0].rvars.size())
      << "of programs of one Func";
  EXPECT_FALSE(transform::has_wavefronts(copy));
  Func result(copy[0]);
  Pipeline(result).auto_schedule(get_host_target());
  return result;
}
std::string loops_in_wavefronts(const Func& f) {
  return loops_in_order(*in_wavefronts(f).function());
}

void expect_same_results(const Func& f, const std::vector<int>& sizes) {
  const oracle::Region region{std::vector<int>(sizes.size()), sizes};
  const oracle::Array expected = oracle::Interpreter({.rounding = oracle::Rounding::Contraction})
                                     .realize(f.function(), region)
                                     .front();
  Func g = in_wavefronts(f);
  const Buffer<float> first = gradient::run_on_threads(g, region, 1, false);
  const auto comparison =
      oracle::compare(expected, *const_cast<Buffer<float>&>(first).raw_buffer(), 4);
  EXPECT_TRUE(comparison.agrees()) << comparison.first_mismatch << "\n" << g.loop_nest();
  for (const int threads : {2, 5})
    EXPECT_TRUE(gradient::same_bits(first, gradient::run_on_threads(g, region, threads, true)));
}

struct Wavefronts : ::testing::Test {
  // A table of width by height elements inside of a border.
  void begin(int width, int height) {
    image = random_image({width + 4, height + 4}, 0.125, 1, 7);
    d = Func("d");
    d(x, y) = image(clamp(x, 0, width + 3), clamp(y, 0, height + 3));
    r = RDom(2, width, 2, height, "r");
  }
  Expr at(const Expr& i, const Expr& j) const { return d(i, j); }

  void edit_distance(int width, int height) {
    begin(width, height);
    d(r.x, r.y) =
        min(d(r.x - 1, r.y - 1) + image(r.x, r.y), min(d(r.x - 1, r.y), d(r.x, r.y - 1)) + 0.7f);
  }
  // Soft dynamic time warping.
  void warp(int width, int height) {
    begin(width, height);
    const Expr a = d(r.x - 1, r.y - 1), b = d(r.x - 1, r.y), c = d(r.x, r.y - 1);
    d(r.x, r.y) = image(r.x, r.y) - log(exp(-a) + exp(-b) + exp(-c));
  }

  Var x{"x"}, y{"y"}, n{"n"};
  Func d{"d"};
  RDom r{0, 1};
  Buffer<float> image;
};

// ---- which updates, and their loops ----

TEST_F(Wavefronts, OfCheapValuesAreUnrolled) {
  edit_distance(60, 50);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
}

TEST_F(Wavefronts, OfCostlyValuesAreVectors) {
  warp(60, 50);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
}

TEST_F(Wavefronts, OfSweepsStayInsideOfTheLoopOverSweeps) {
  begin(40, 40);
  RDom s(1, 40, 1, 40, 0, 3, "s");
  d(s.x, s.y) = 0.25f * (d(s.x - 1, s.y) + d(s.x + 1, s.y) + d(s.x, s.y - 1) + d(s.x, s.y + 1));
  EXPECT_EQ(loops_in_wavefronts(d), "s.z rows front row");
}

TEST_F(Wavefronts, OfSmallTablesAreNone) {
  edit_distance(12, 50);
  EXPECT_EQ(loops_in_wavefronts(d), "r.y r.x");
  edit_distance(50, 6);
  EXPECT_EQ(loops_in_wavefronts(d), "r.y r.x");
  begin(40, 40);
  d(r.x, r.y) = d(r.x - 1, r.y) + d(r.x + 3, r.y - 1);
  EXPECT_EQ(loops_in_wavefronts(d), "r.y r.x") << "the slope is 4";
  begin(60, 40);
  d(r.x, r.y) = d(r.x - 1, r.y) + d(r.x + 3, r.y - 1);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
}

TEST_F(Wavefronts, OfManyTablesAreNone) {
  begin(40, 40);
  Func many("many");
  many(n, x, y) = d(x, y) + n;
  many(n, r.x, r.y) = many(n, r.x - 1, r.y) + many(n, r.x, r.y - 1);
  many.bound(n, 0, 64);
  EXPECT_FALSE(transform::has_wavefronts({many.function()}));
}

TEST_F(Wavefronts, IfRowsAreIndependentAreNone) {
  begin(40, 40);
  d(r.x, r.y) = d(r.x - 1, r.y) * 0.5f + image(r.x, r.y);
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
}

TEST_F(Wavefronts, IfARowNeedsTheEndOfTheRowBeforeAreNone) {
  begin(40, 40);
  d(r.x, r.y) = d(r.x - 1, r.y) + d(41, r.y - 1);
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
  expect_same_results(d, {44, 44});
}

TEST_F(Wavefronts, IfDataDecideWhatIsReadAreNone) {
  begin(40, 40);
  d(r.x, r.y) = d(r.x - 1, r.y) + d(clamp(cast<int>(image(r.x, r.y) * 40), 0, 40), r.y - 1);
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
  expect_same_results(d, {44, 44});
}

TEST_F(Wavefronts, IfDataDecideWhatIsWrittenAreNone) {
  begin(40, 40);
  d(r.x, clamp(cast<int>(image(r.x, r.y) * 40), 0, 40)) = d(r.x - 1, r.y) + d(r.x, r.y - 1);
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
}

TEST_F(Wavefronts, OfScheduledFuncsAreNone) {
  edit_distance(60, 50);
  d.compute_root();
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
}

TEST_F(Wavefronts, IfOthersAreComputedInTheirLoopsAreNone) {
  begin(60, 50);
  Func cost("cost");
  cost(x, y) = image(x, y) * 2.0f;
  d(r.x, r.y) = cost(r.x, r.y) + min(d(r.x - 1, r.y), d(r.x, r.y - 1));
  EXPECT_TRUE(transform::has_wavefronts({d.function()}));
  cost.compute_at(d, r.y);
  EXPECT_FALSE(transform::has_wavefronts({d.function()}));
}

// ---- results ----

TEST_F(Wavefronts, AreEqualToTheInterpreter) {
  edit_distance(37, 41);
  expect_same_results(d, {41, 45});
  warp(37, 41);
  expect_same_results(d, {41, 45});
}

TEST_F(Wavefronts, OfWholeBlocks) {
  warp(48, 32);
  expect_same_results(d, {52, 36});
}

TEST_F(Wavefronts, FurtherAway) {
  begin(40, 37);
  d(r.x, r.y) = 0.4f * d(r.x - 2, r.y) + 0.3f * d(r.x + 1, r.y - 2) + 0.2f * d(r.x - 1, r.y - 1);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {44, 41});
}

TEST_F(Wavefronts, OfReadsAhead) {
  begin(60, 37);
  d(r.x, r.y) = 0.4f * d(r.x - 1, r.y) + 0.3f * sin(d(r.x + 2, r.y - 1)) + 0.2f * d(r.x, r.y + 1);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {64, 41});
}

TEST_F(Wavefronts, Backward) {
  begin(40, 37);
  const Expr i = 43 - r.x, j = 40 - r.y;
  d(i, j) = 0.4f * d(i + 1, j) + 0.3f * sqrt(d(i, j + 1)) + 0.2f * d(i + 1, j + 1);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {44, 41});
}

TEST_F(Wavefronts, OfColumns) {
  begin(40, 37);
  RDom s(2, 37, 2, 40, "s");
  d(s.y, s.x) = 0.4f * d(s.y - 1, s.x) + 0.3f * d(s.y, s.x - 1) + image(s.y, s.x);
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {44, 41});
}

TEST_F(Wavefronts, OfReadsThatAreClampedAndChosen) {
  begin(40, 37);
  RDom s(0, 40, 0, 37, "s");
  d(s.x, s.y) = image(s.x, s.y) + select(s.x > 0, d(max(s.x - 1, 0), s.y), 1.0f) * 0.5f +
                0.25f * d(s.x, max(s.y - 1, 0));
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {44, 41});
}

TEST_F(Wavefronts, OfATriangle) {
  begin(40, 40);
  r.where(r.x <= r.y);
  d(r.x, r.y) = image(r.x, r.y) + log(d(r.x - 1, r.y) + d(r.x, r.y - 1));
  EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
  expect_same_results(d, {44, 44});
}

TEST_F(Wavefronts, OfSweeps) {
  begin(40, 37);
  RDom s(1, 40, 1, 37, 0, 3, "s");
  d(s.x, s.y) = 0.25f * (d(s.x - 1, s.y) + d(s.x + 1, s.y) + d(s.x, s.y - 1) + d(s.x, s.y + 1));
  expect_same_results(d, {44, 41});
}

// The elements of one row, again and again.
TEST_F(Wavefronts, OfSweepsOverARow) {
  Func u("u");
  u(x) = cast<float>(x % 7);
  RDom s(1, 50, 0, 12, "s");
  u(s.x) = 0.4f * u(s.x - 1) + 0.3f * u(s.x + 1) + 0.1f * u(s.x);
  EXPECT_EQ(loops_in_wavefronts(u), "rows front row");
  expect_same_results(u, {52});
}

TEST_F(Wavefronts, OfAFewTables) {
  begin(40, 37);
  Func few("few");
  few(x, y, n) = image(x, y) + n;
  few(r.x, r.y, n) = log(few(r.x - 1, r.y, n) + few(r.x, r.y - 1, n) + 1.0f);
  few.bound(n, 0, 2);
  EXPECT_EQ(loops_in_wavefronts(few), "n rows front row");
  expect_same_results(few, {44, 41, 2});
}

// With extents that nobody knows: none, one, fewer than a block, several blocks.
TEST_F(Wavefronts, OfAnySize) {
  Param<int> width("width"), height("height");
  for (const auto& [w, h] : {std::pair(0, 5), {5, 0}, {1, 1}, {1, 40}, {40, 1}, {7, 9}, {33, 40}}) {
    SCOPED_TRACE(text(w, " by ", h));
    begin(50, 50);
    width.set(w);
    height.set(h);
    RDom s(1, width, 1, height, "s");
    d(s.x, s.y) = log(1.0f + d(s.x - 1, s.y) + d(s.x, s.y - 1));
    EXPECT_EQ(loops_in_wavefronts(d), "rows front row");
    expect_same_results(d, {44, 44});
  }
}

// The image is exactly as large as what the table reads.
TEST_F(Wavefronts, ReadNothingOutsideOfImages) {
  ImageParam in(Float(32), 2, "in");
  d(x, y) = 1.0f;
  RDom s(0, in.width(), 0, in.height(), "s");
  d(s.x + 1, s.y + 1) = log(in(s.x, s.y) + d(s.x, s.y + 1) + d(s.x + 1, s.y));
  Buffer<float> values = random_image({37, 35}, 1, 2, 3);
  in.set(values);
  Func last("last");
  last(x) = d(in.width() - x, in.height());
  const std::vector<FuncPtr> copy = graph::copy_graph({last.function()}).outputs;
  transform::run_in_wavefronts(copy);
  Func fast(copy[0]);
  Pipeline(fast).auto_schedule(get_host_target());
  Buffer<float> expected = last.realize({5}), found = fast.realize({5});
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(found(i), expected(i), 1e-5);
}

// ---- gradients ----

std::vector<std::string> fronts_of_gradient(const Func& gradient) {
  std::vector<std::string> result;
  for (const FuncPtr& f :
       graph::topological_order(driver::schedule_unscheduled({gradient.function()}))) {
    if (f->updates.size() == 1 && loops_in_order(*f).find("front") != std::string::npos)
      result.push_back(loops_in_order(*f));
  }
  return result;
}

// The costs of a table are those of a row, so that there are few differences to compute.
struct GradientsOfWavefronts : Wavefronts {
  void begin_with_row(int width, int height) {
    image = random_image({width + 4}, 0.125, 1, 7);
    d = Func("d");
    d(x, y) = image(clamp(x, 0, width + 3)) * (1.0f + 0.125f * cast<float>(y));
    r = RDom(2, width, 2, height, "r");
  }
  void expect_gradient(int width, int height) {
    Func last("last");
    last(x, y) = d(x + width - 2, y + height - 2);
    gradient::expect_gradient(gradient::weighted_sum(last, {4, 4}), image);
  }
};

TEST_F(GradientsOfWavefronts, RunInWavefrontsForwardAndBackward) {
  warp(70, 60);
  const Func loss = gradient::weighted_sum(d, {74, 64});
  EXPECT_EQ(fronts_of_gradient(propagate_adjoints(loss)(image)),
            std::vector<std::string>(2, "rows front row"));
}

TEST_F(GradientsOfWavefronts, OfAWarp) {
  begin_with_row(35, 17);
  const Expr a = d(r.x - 1, r.y - 1), b = d(r.x - 1, r.y), c = d(r.x, r.y - 1);
  d(r.x, r.y) = image(r.x) - log(exp(-a) + exp(-b) + exp(-c));
  expect_gradient(35, 17);
}

TEST_F(GradientsOfWavefronts, OfAnIntegralImage) {
  begin_with_row(19, 17);
  d(r.x, r.y) =
      image(r.x) + 0.5f * d(r.x - 1, r.y) + 0.5f * d(r.x, r.y - 1) - 0.25f * d(r.x - 1, r.y - 1);
  expect_gradient(19, 17);
}

TEST_F(GradientsOfWavefronts, OfReadsAhead) {
  begin_with_row(19, 17);
  d(r.x, r.y) = image(r.x) + 0.5f * d(r.x - 1, r.y) + 0.25f * d(r.x + 1, r.y - 1);
  expect_gradient(19, 17);
}

TEST_F(GradientsOfWavefronts, OfSweeps) {
  begin_with_row(17, 17);
  RDom s(1, 17, 1, 17, 0, 2, "s");
  d(s.x, s.y) = 0.25f * (d(s.x - 1, s.y) + d(s.x + 1, s.y) + d(s.x, s.y - 1) + d(s.x, s.y + 1));
  expect_gradient(17, 17);
}

}  // namespace
}  // namespace retrograde
