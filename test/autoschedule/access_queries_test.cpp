// Sizes, boxes, lane forms and composed reads of small programs.
#include <gtest/gtest.h>

#include <cmath>

#include "autodiff/derivative.h"
#include "autoschedule/access/compose.h"
#include "autoschedule/access/cover.h"
#include "autoschedule/access/lane_form.h"
#include "autoschedule/access/sizes.h"
#include "frontend/language/boundary_conditions.h"
#include "support/variables.h"

namespace retrograde {
namespace {

using namespace planning;

constexpr SizeDefaults defaults{1000};
constexpr LineSize line{16};

// A program with one output, and what the planner knows of it.
struct Known {
  explicit Known(const Func& output) : graph({output.function()}), sizes(graph, defaults) {}

  FuncId id(const Func& f) const { return graph.find(f.function().get()); }
  ImageId image(const ImageParam& image) const {
    for (size_t i = 0; i < graph.images().size(); ++i)
      if (graph.images()[i]->name == image.name()) return static_cast<ImageId>(i);
    return -1;
  }
  const Access& read(const Func& f, int stage, size_t number) const {
    return graph.stage({id(f), static_cast<int16_t>(stage)}).reads[number];
  }

  AccessGraph graph;
  SizeModel sizes;
};

TEST(SizeModel, PrefersBoundsToEstimatesToRegionsToTheDefault) {
  ImageParam image(Float(32), 2, "image");
  Func bounded("bounded"), read("read"), out("out"), unknown("unknown");
  bounded(x, y) = image(x, y);
  read(x, y) = bounded(x, y) * 2.0f;
  unknown(x) = image(x, 0);
  out(x, y) = read(x - 1, 2 * y) + read(x + 1, 2 * y + 1) + unknown(cast<int>(image(x, y)));
  out.bound(x, 0, 64).set_estimate(y, 0, 48);
  bounded.bound(x, -8, 128);
  image.dim(0).set_estimate(0, 90);
  const Known known(out);

  const planning::Extent bound = known.sizes.of(known.id(out), 0);
  EXPECT_EQ(bound.source, SizeSource::Bound);
  EXPECT_EQ(bound.estimate, 64);
  EXPECT_TRUE(bound.is_constant());
  EXPECT_EQ(bound.multiple_of, 64);
  const planning::Extent estimate = known.sizes.of(known.id(out), 1);
  EXPECT_EQ(estimate.source, SizeSource::Estimate);
  EXPECT_EQ(estimate.estimate, 48);
  EXPECT_FALSE(estimate.is_constant());
  const planning::Extent region = known.sizes.of(known.id(read), 0);
  EXPECT_EQ(region.source, SizeSource::Region);
  EXPECT_EQ(region.estimate, 66);
  EXPECT_EQ(region.high, 66) << "of a bound: no more is ever computed";
  EXPECT_EQ(known.sizes.of(known.id(read), 1).estimate, 96);
  EXPECT_EQ(known.sizes.of(known.id(bounded), 0).estimate, 128) << "not the 66 that are read";
  EXPECT_EQ(known.sizes.of_image(known.image(image), 0).estimate, 90);
  EXPECT_EQ(known.sizes.of(known.id(unknown), 0).source, SizeSource::Default);
  EXPECT_EQ(known.sizes.of(known.id(unknown), 0).estimate, defaults.extent);
}

// The gradient of a stencil needs more of an adjoint than the estimate of its primal says.
TEST(SizeModel, EstimatesAreNoLimitsToWhatReadsNeed) {
  Func read("read"), clamped("clamped"), out("out");
  read(x) = x;
  clamped(x) = x;
  for (Func* f : {&read, &clamped}) f->set_estimate(x, 0, 128);
  out(x) = read(x - 2) + read(x) + clamped(clamp(x, -8, 200));
  out.set_estimate(x, 0, 130);
  const Known known(out);
  EXPECT_EQ(known.sizes.of(known.id(read), 0).estimate, 132);
  EXPECT_EQ(known.sizes.of(known.id(clamped), 0).estimate, 128);
}

TEST(SizeModel, KnowsShapesOfImages) {
  ImageParam image(Float(32), 1, "image");
  Buffer<float> values(40);
  image.set(values);
  Func inside = BoundaryConditions::repeat_edge(image), out("out");
  out(x) = inside(x - 1) + inside(x + 1);
  const Known known(out);
  EXPECT_EQ(known.sizes.of_image(known.image(image), 0).source, SizeSource::Image);
  EXPECT_EQ(known.sizes.of_image(known.image(image), 0).estimate, 40);
  const Access& read = known.read(inside, 0, 0);
  EXPECT_TRUE(read.index[0].clamped);
  EXPECT_EQ(known.sizes.range(read.index[0], read.by), (ir::ConstantRange{0, 39}));
}

TEST(SizeModel, ReadsAllInsideOfAMirrorOnceARegionGoesBeyondIt) {
  ImageParam image(Float(32), 1, "image");
  Buffer<float> values(40);
  image.set(values);
  Func edge = BoundaryConditions::repeat_edge(image),
       mirrored = BoundaryConditions::mirror_image(image), out("out");
  out(x) = edge(x) + mirrored(x);
  out.bound(x, 30, 20);
  const Known known(out);
  const Access &at_edge = known.read(edge, 0, 0), &in_mirror = known.read(mirrored, 0, 0);
  EXPECT_EQ(known.sizes.range(at_edge.index[0], at_edge.by), (ir::ConstantRange{30, 39}));
  EXPECT_EQ(known.sizes.range(in_mirror.index[0], in_mirror.by), (ir::ConstantRange{0, 39}));
}

// The gradient by weights whose number nothing says but the sum that reads them.
TEST(SizeModel, MakesAnAdjointAsLargeAsItsFunc) {
  ImageParam values(Float(32), 1, "values"), image(Float(32), 1, "image");
  Func weights("weights"), loss("loss");
  const RDom r(0, 7);
  weights(x) = image(x);
  loss() = 0.0f;
  loss() += weights(r) * values(r);
  const Func adjoint = propagate_adjoints(loss)(weights);
  adjoint.function()->schedule.estimates.clear();
  const AccessGraph graph({loss.function(), adjoint.function()});
  const SizeModel sizes(graph, defaults);
  const planning::Extent extent = sizes.of(graph.find(adjoint.function().get()), 0);
  EXPECT_EQ(extent.estimate, 7);
  EXPECT_EQ(extent.source, SizeSource::Region);
  EXPECT_FALSE(extent.is_constant());
}

using Extents = std::vector<int64_t>;

TEST(Extents, AreThoseOfTheBoxThatACoverNeeds) {
  ImageParam image(Float(32), 2, "image"), places(UInt(8), 2, "places");
  Func out("out");
  RDom r(0, 3);
  out(x, y) += image(x + r, 2 * y - 3 * r) + image(x / 2, (y + 1) / 2) + image(x % 8, 50 - x) +
               image(clamp(x + 90, 0, 99), clamp(cast<int>(places(x, y)), 3, 9)) +
               image(places(x, y) + y, 7);
  out.bound(x, 0, 64).bound(y, 0, 32);
  image.dim(0).set_bounds(0, 100).dim(1).set_bounds(-50, 200);
  const Known known(out);
  const auto box = [&](size_t read, const Cover& cover) {
    return extents(known.read(out, 1, read), cover, known.sizes);
  };
  EXPECT_EQ(box(1, {8, 4, 3}), (Extents{10, 13}));
  EXPECT_EQ(box(1, {1, 1, 1}), (Extents{1, 1}));
  EXPECT_EQ(box(2, {16, 4, 1}), (Extents{8, 3})) << "y + 1 begins in the middle of a pair";
  EXPECT_EQ(box(2, {3, 1, 1}), (Extents{2, 1}));
  EXPECT_EQ(box(3, {4, 1, 1}), (Extents{4, 4})) << "4 divides 8, so remainders do not wrap";
  EXPECT_EQ(box(3, {5, 1, 1}), (Extents{8, 5}));
  EXPECT_EQ(box(5, {64, 32, 1}), (Extents{64, 7}));
  EXPECT_EQ(box(5, {2, 1, 1}), (Extents{2, 7}));
  EXPECT_EQ(box(6, {1, 1, 1}), (Extents{1, 1}));
  EXPECT_EQ(box(6, {1, 2, 1}), (Extents{100, 1})) << "at most all of the dimension";
}

TEST(Extents, OfSeveralAccessesAreThoseOfOneBox) {
  ImageParam image(Float(32), 2, "image");
  Func out("out");
  out(x, y) = image(x - 1, y) + image(x + 2, y) + image(2 * x, y) + image(x, 40);
  out.bound(x, 0, 64).bound(y, 0, 32);
  image.dim(0).set_bounds(-10, 200).dim(1).set_bounds(0, 100);
  const Known known(out);
  const auto box = [&](const std::vector<size_t>& reads, const Cover& cover) {
    std::vector<const Access*> accesses;
    for (const size_t i : reads) accesses.push_back(&known.read(out, 0, i));
    return extents(accesses, cover, known.sizes);
  };
  EXPECT_EQ(box({0, 1}, {8, 1}), (Extents{11, 1}));
  EXPECT_EQ(box({1, 0}, {8, 1}), (Extents{11, 1}));
  EXPECT_EQ(box({0, 2}, {64, 1}), (Extents{128, 1})) << "-1 to 126, the whole loop";
  EXPECT_EQ(box({0, 2}, {8, 1}), (Extents{8 + 56 + 8, 1})) << "x = 56: from 55 to 126";
  EXPECT_EQ(box({0, 3}, {1, 1}), (Extents{2, 41})) << "row 40 and any row y";
}

TEST(LaneForm, TellsHowLanesLieInMemory) {
  ImageParam image(Float(32), 2, "image"), places(Int(32), 1, "places");
  Func out("out");
  out(x, y) = image(x, y) + image(10 - x, 0) + image(2 * x, 0) + image(0, x) + image(x / 2, 0) +
              image(places(x), y) + image(0, y);
  out.bound(x, 0, 64).bound(y, 0, 10);
  image.dim(0).set_estimate(0, 100);
  image.dim(1).set_estimate(0, 100);
  const Known known(out);
  using Kind = LaneForm::Kind;
  const std::vector<std::tuple<size_t, Kind, double, double>> expected{
      {0, Kind::Contiguous, 0, 1}, {1, Kind::Reversed, 0, 1}, {2, Kind::Strided, 2, 2},
      {3, Kind::Strided, 100, 16}, {4, Kind::Gather, 0, 1},   {6, Kind::Gather, 0, 16},
      {7, Kind::Uniform, 0, 1}};
  for (const auto& [number, kind, stride, lines] : expected) {
    SCOPED_TRACE(planning::print(known.graph, known.read(out, 0, number)));
    const LaneForm form = lane_form(known.read(out, 0, number), 0, 16, known.sizes, line);
    EXPECT_EQ(form.kind, kind);
    EXPECT_EQ(form.stride, stride);
    EXPECT_EQ(form.lines, lines);
  }
}

TEST(ComposedReads, MergeEqualReadsOfAChain) {
  ImageParam image(Float(32), 1, "image");
  std::vector<Func> steps{Func("step")};
  steps[0](x) = image(x);
  for (int i = 0; i < 20; ++i) {
    Func next("step");
    next(x) = steps.back()(x - 1) + steps.back()(x) + steps.back()(x + 1);
    steps.push_back(next);
  }
  Func out("out");
  out(x) = steps.back()(2 * x);
  const Known known(out);
  std::vector<bool> inlined(known.graph.funcs().size(), true);
  inlined[static_cast<size_t>(known.id(out))] = false;
  const ComposedReads reads(known.graph, inlined, 4096);
  const StageId stage{known.id(out), 0};
  EXPECT_TRUE(reads.is_complete(stage));
  ASSERT_EQ(reads.of(stage).size(), 41u);
  EXPECT_EQ(reads.elements_of(stage, known.id(steps[0])), 41u);
  EXPECT_EQ(reads.elements_of(stage, known.id(steps.back())), 1u);
  for (const Access& read : reads.of(stage)) {
    EXPECT_EQ(read.image, known.image(image));
    EXPECT_EQ(read.index[0].coefficient(0), 2);
    EXPECT_EQ(read.through.size(), steps.size());
  }
  const ComposedReads few(known.graph, inlined, 10);
  EXPECT_FALSE(few.is_complete(stage));
}

TEST(ComposedReads, KeepQuotientsPlacesAndRanges) {
  ImageParam image(Float(32), 2, "image"), places(Int(32), 2, "places");
  Func halved("halved"), gathered("gathered"), out("out");
  halved(x, y) = image(x / 2, clamp(y, 0, 9));
  gathered(x, y) = image(clamp(places(x, y), 0, 99), y);
  out(x, y) = halved(x + 1, 2 * y) + gathered(y, x) + gathered(x, y) + gathered(x + 1, y);
  const Known known(out);
  std::vector<bool> inlined(known.graph.funcs().size(), false);
  inlined[static_cast<size_t>(known.id(halved))] = true;
  inlined[static_cast<size_t>(known.id(gathered))] = true;
  const StageId stage{known.id(out), 0};
  const ComposedReads composed(known.graph, inlined, 100);
  const std::vector<Access>& reads = composed.of(stage);
  std::vector<Access> gathers;
  for (const Access& read : reads) {
    if (read.image != known.image(image)) continue;
    if (read.place.defined()) {
      gathers.push_back(read);
      EXPECT_EQ(known.sizes.range(read.index[0], stage), (ir::ConstantRange{0, 99}));
      continue;
    }
    EXPECT_EQ(read.index[0].divisor, 2);
    EXPECT_EQ(read.index[0].low, 1);
    EXPECT_EQ(read.index[1].coefficient(1), 2);
    EXPECT_TRUE(read.index[1].clamped);
    EXPECT_EQ(known.sizes.range(read.index[1], stage), (ir::ConstantRange{0, 9}));
  }
  ASSERT_EQ(gathers.size(), 3u);
  const auto numbered = [&](std::vector<int16_t> iterators) {
    return std::ranges::count_if(gathers, [&](const Access& read) {
      return read.place.iterators == iterators &&
             read.place.number == known.read(gathered, 0, 1).place.number;
    });
  };
  EXPECT_EQ(numbered({0, 1}), 1) << "the number of the place in the Func that was inlined";
  EXPECT_EQ(numbered({1, 0}), 1);
}

// The adjoint of a gather scatters to the same places.
TEST(Places, AreEqualUpToTheNamesOfIterators) {
  ImageParam image(Float(32), 2, "image"), flow(Int(32), 2, "flow");
  Func gathered("gathered"), scattered("scattered"), out("out");
  RDom r(0, 64, 0, 48);
  gathered(x, y) = image(x + flow(x, y), y);
  scattered(x, y) = 0.0f;
  scattered(r.x + flow(clamp(r.x, 0, 63), r.y), r.y) += 1.0f;
  out(x, y) = gathered(x, y) + scattered(x, y);
  const Known known(out);
  const Access& gather = known.read(gathered, 0, 1);
  const Access& scatter = known.graph.stage({known.id(scattered), 1}).write;
  ASSERT_TRUE(gather.place.defined());
  EXPECT_EQ(gather.place.number, scatter.place.number);
  EXPECT_EQ(gather.index[0].data_loops(), set_of(0) | set_of(1));
  EXPECT_EQ(known.graph.consumers(known.id(gathered)), (std::vector<StageId>{{known.id(out), 0}}));
}

TEST(Guard, HasTheFractionOfItsCongruences) {
  ImageParam image(Float(32), 1, "image");
  Func out("out");
  RDom r(0, 9);
  r.where((r + 1) % 3 == 0 && r >= 2);
  out(x) = 0.0f;
  out(x) += select(x % 2 == 1, image(x + r), 0.0f);
  const Known known(out);
  const StageNode& stage = known.graph.stage({known.id(out), 1});
  ASSERT_EQ(stage.guard.congruences.size(), 1u);
  EXPECT_EQ(stage.guard.congruences[0].remainder, 2);
  EXPECT_EQ(stage.guard.nonnegative.size(), 1u);
  EXPECT_DOUBLE_EQ(stage.guard.fraction(), 1.0 / 3);
  EXPECT_DOUBLE_EQ(known.read(out, 1, 1).guard.fraction(), 0.5);
}

}  // namespace
}  // namespace retrograde
