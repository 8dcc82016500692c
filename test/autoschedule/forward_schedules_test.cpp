// The built-in autoscheduler on forward programs: selects along small dimensions, rows along long
// ones, chains behind transposed reads, slices that a reduction reads through inlined Funcs, split
// reductions at data-dependent indices, and rows packed for tiles that read through boundary
// conditions.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <algorithm>
#include <vector>

#include "graph/graph.h"
#include "ir/build.h"
#include "support/rules_schedule.h"

namespace retrograde {
namespace {

Buffer<float> some_picture(int width, int height) {
  Buffer<float> picture(width, height);
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++)
      picture(x, y) = static_cast<float>((x * 7 + y * 13 + x * y % 5) % 31) * 0.125f;
  }
  return picture;
}

struct Source {
  Expr operator()(const Expr& x, const Expr& y) const {
    return picture(clamp(x, 0, picture.width() - 1), clamp(y, 0, picture.height() - 1));
  }
  Buffer<float> picture = some_picture(300, 280);
};

// A program without a schedule and under the autoscheduler.
template <class Program>
struct Scheduled {
  Scheduled() { schedule_by_rules(Pipeline(program.out)); }

  void expect_same_values(const std::vector<int>& sizes) {
    Program plain;
    const Buffer<float> found = program.out.realize(sizes), expected = plain.out.realize(sizes);
    int wrong = 0;
    expected.for_each_element([&](const int* at) {
      wrong += std::abs(found(at) - expected(at)) > 1e-4f * (1 + std::abs(expected(at)));
    });
    EXPECT_EQ(wrong, 0);
  }

  Program program;
};

const std::vector<graph::Dim>& loops_of(const Func& f) { return f.function()->pure->schedule.dims; }
bool is_unrolled(const Func& f, const std::string& var) {
  return std::any_of(loops_of(f).begin(), loops_of(f).end(), [&](const graph::Dim& loop) {
    return loop.var == var && loop.runs == ForType::Unrolled;
  });
}
bool is_inside_of(const Func& f, const Func& host) {
  const graph::LoopLevel& level = f.function()->schedule.compute_level;
  return level.kind == graph::LoopLevel::Kind::At && level.func == host.name();
}

struct Opponents {
  Opponents() {
    opponent(x, y, c) = mux(c, {source(x, y) + source(x + 1, y), source(x, y) - source(x + 1, y),
                                source(x, y) * source(x, y + 1)});
    Expr sum = sqrt(abs(opponent(x, y, 0) * opponent(x - 1, y, 2))) + opponent(x + 1, y, 1);
    for (int k = 1; k < 4; k++) sum += opponent(x + k, y, 0) * opponent(x, y + k, 2);
    out(x, y) = sum;
  }
  Source source;
  Var x{"x"}, y{"y"}, c{"c"};
  Func opponent{"opponent"}, out{"out"};
};

// Sums and differences of pairs, interleaved again.
struct Pairs {
  Pairs() {
    const Expr a = source(2 * x, y), b = source(2 * x + 1, y);
    halves(x, y, k) = select(k == 0, exp(-a) + b, a - sqrt(abs(b) + 1.0f));
    out(x, y) = halves(x / 2, y, x % 2);
  }
  Source source;
  Var x{"x"}, y{"y"}, k{"k"};
  Func halves{"halves"}, out{"out"};
};

// Levels selected by data, which a clamp keeps within a few.
struct Levels {
  Levels() {
    level(x, y, k) = select(k < 2, exp(-source(x, y)) * k, sqrt(source(x, y) + k));
    const Expr which = clamp(cast<int>(source(x, y) * 2.0f), 0, 3);
    out(x, y) = level(x, y, which) + level(x + 1, y, 3 - which);
  }
  Source source;
  Var x{"x"}, y{"y"}, k{"k"};
  Func level{"level"}, out{"out"};
};

TEST(Choices, AreUnrolledAlongDimensionsThatConstantsFix) {
  Scheduled<Opponents> of;
  EXPECT_TRUE(is_unrolled(of.program.opponent, "c"));
  of.expect_same_values({101, 37});
}

TEST(Choices, AreMadeOnceWhereTheReadersLoopsMoveThem) {
  Scheduled<Pairs> of;
  EXPECT_TRUE(is_unrolled(of.program.halves, "k"));
  of.expect_same_values({101, 37});
}

TEST(Choices, AreFixedByClampsOfWhatDataDecide) {
  Scheduled<Levels> of;
  EXPECT_TRUE(is_unrolled(of.program.level, "k"));
  of.expect_same_values({101, 37});
}

TEST(Choices, StayWhereSizesDecideHowManyThereAre) {
  Opponents program;
  Func all("all");
  all(program.x, program.y, program.c) = program.opponent(program.x, program.y, program.c);
  all.set_estimate(program.c, 0, 3);
  schedule_by_rules(Pipeline({program.out, all}));
  EXPECT_FALSE(is_unrolled(program.opponent, "c"));
}

TEST(Choices, StayWhereTheyAreSwitchedOff) {
  Opponents program;
  AutoscheduleOptions options;
  options.without = {Decision::Choices};
  Pipeline(program.out).auto_schedule(get_host_target(), options);
  EXPECT_FALSE(is_unrolled(program.opponent, "c"));
}

struct Taps {
  Taps() {
    taps(k, x) = exp(-cast<float>(k * k) * (1.0f + source(x, 0)));
    Expr sum = 0.0f;
    for (int i = 0; i < 4; i++) sum += taps(i, x) * source(x + i, y);
    out(x, y) = sum;
    out.set_estimate(x, 0, 250).set_estimate(y, 0, 200);
  }
  Source source;
  Var k{"k"}, x{"x"}, y{"y"};
  Func taps{"taps"}, out{"out"};
};

// Two values for each pixel, side by side.
struct Slopes {
  Slopes() {
    slope(c, x, y) = sqrt(abs(source(x + c, y + 1 - c) - source(x, y)) + 0.5f) * exp(-source(x, y));
    out(x, y) = slope(0, x, y) * slope(1, x, y) + slope(0, x + 1, y) + slope(1, x, y + 1);
    out.set_estimate(x, 0, 250).set_estimate(y, 0, 200);
  }
  Source source;
  Var c{"c"}, x{"x"}, y{"y"};
  Func slope{"slope"}, out{"out"};
};

TEST(LaneDimensions, AreTheLongOnesThatReadersRunAlong) {
  Scheduled<Taps> taps;
  EXPECT_EQ(taps.program.taps.function()->schedule.storage_dims[0], "x");
  EXPECT_EQ(loops_of(taps.program.taps)[0].runs, ForType::Vectorized);
  taps.expect_same_values({101, 37});
  Scheduled<Slopes> slopes;
  EXPECT_EQ(slopes.program.slope.function()->schedule.storage_dims[0], "x");
  slopes.expect_same_values({101, 37});
}

TEST(LaneDimensions, AreOfWhatASumOfAllReadsToo) {
  const auto sum_of = [](bool is_scheduled) {
    Slopes program;
    Func total("total");
    RDom r(0, 100, 0, 50);
    total() = 0.0f;
    total() += program.slope(0, r.x, r.y) * program.slope(1, r.x, r.y) + program.slope(0, r.y, r.x);
    if (is_scheduled) schedule_by_rules(Pipeline(total));
    return Buffer<float>(total.realize())();
  };
  EXPECT_NEAR(sum_of(true) / sum_of(false), 1, 1e-4);
}

TEST(LaneDimensions, AreTheFirstWhereReadersRunAlongIt) {
  Taps program;
  Func all("all");
  all(program.k, program.x) = program.taps(program.k, program.x) * 2.0f;
  all.set_estimate(program.k, 0, 4).set_estimate(program.x, 0, 250);
  schedule_by_rules(Pipeline({program.out, all}));
  EXPECT_EQ(program.taps.function()->schedule.storage_dims[0], "k");
}

// Columns of each picture of a batch, permuted, as rows.
struct Turned {
  Turned() {
    heavy(x, y, n) = exp(-source(x + n, y)) + sqrt(source(x, y + n) + 1.0f);
    shuffled(x, y, n) = sin(heavy(x, (y * 5) % 64, n)) * heavy(x, 63 - y, n);
    out(x, y, n) = shuffled(y, x, n) + shuffled(y, (x + 1) % 64, n);
    out.bound(x, 0, 64).bound(y, 0, 128).bound(n, 0, 40);
  }
  Source source;
  Var x{"x"}, y{"y"}, n{"n"};
  Func heavy{"heavy"}, shuffled{"shuffled"}, out{"out"};
};

// Column sums of blocks of rows, transposed.
struct TurnedSums {
  TurnedSums() {
    part(x, i, k) = exp(-source(x, 8 * i + k)) + source(x, 8 * i + k + 1);
    out(x, y) = part(y, x / 8, x % 8) + part(y, x / 8, 7 - x % 8) + part(y, 63 - x / 8, 3);
    out.bound(x, 0, 512).bound(y, 0, 700);
  }
  Source source;
  Var x{"x"}, y{"y"}, i{"i"}, k{"k"};
  Func part{"part"}, out{"out"};
};

TEST(ChainsBehindTiles, RunInTheRowsOfTiles) {
  Scheduled<Turned> turned;
  EXPECT_TRUE(is_inside_of(turned.program.shuffled, turned.program.out));
  EXPECT_TRUE(is_inside_of(turned.program.heavy, turned.program.out));
  turned.expect_same_values({64, 128, 40});
  Scheduled<TurnedSums> sums;
  EXPECT_TRUE(is_inside_of(sums.program.part, sums.program.out));
  sums.expect_same_values({512, 700});
}

// Similarity of windows around two pixels, by offset, through inlined Funcs.
struct Likenesses {
  Likenesses() {
    const RDom each(0, 8, 0, 8);
    difference(x, y, u, v) = exp(-abs(source(x + u, y + v) - source(x, y)));
    windows(x, y, u, v) =
        exp(difference(x - 1, y, u, v) + difference(x, y, u, v) + difference(x + 1, y, u, v));
    weight(x, y, u, v) =
        1.0f / (windows(x, y - 1, u, v) + windows(x, y, u, v) + windows(x, y + 1, u, v));
    out(x, y) = 0.0f;
    out(x, y) += weight(x, y, each.x, each.y) * source(x + each.x, y + each.y);
    out.bound(x, 0, 280).bound(y, 0, 270);
  }
  Source source;
  Var x{"x"}, y{"y"}, u{"u"}, v{"v"};
  Func difference{"difference"}, windows{"windows"}, weight{"weight"}, out{"out"};
};

// The costs of many depths, and their soft minimum.
struct Depths {
  Depths() {
    const RDom depth(0, 64);
    cost(x, y, d) = sqrt(abs(source(x + d, y) - source(x, y)) + 0.25f) + exp(-source(x + d, y));
    blurred(x, y, d) = cost(x, y - 1, d) + 2.0f * cost(x, y, d) + cost(x, y + 1, d);
    out(x, y) = 0.0f;
    out(x, y) += exp(-blurred(x, y, depth)) * cast<float>(depth);
    out.bound(x, 0, 280).bound(y, 0, 270);
  }
  Source source;
  Var x{"x"}, y{"y"}, d{"d"};
  Func cost{"cost"}, blurred{"blurred"}, out{"out"};
};

TEST(SlicesReadThroughInlinedFuncs, AreComputedInTheReductionWithTheirChain) {
  Scheduled<Likenesses> likenesses;
  EXPECT_TRUE(is_inside_of(likenesses.program.windows, likenesses.program.out));
  EXPECT_TRUE(is_inside_of(likenesses.program.difference, likenesses.program.out));
  likenesses.expect_same_values({280, 270});
  Scheduled<Depths> depths;
  EXPECT_TRUE(is_inside_of(depths.program.cost, depths.program.out));
  depths.expect_same_values({280, 270});
}

// For each pixel, the number of pixels that are darker, and the mean of the neighbours of equally
// bright pixels.
struct Histograms {
  Histograms() {
    const RDom r(0, 300, 0, 280), up(1, 63);
    const auto level = [&](const Expr& x, const Expr& y) {
      return clamp(cast<int>(source(x, y) * 16.0f), 0, 63);
    };
    counts(i) = 0;
    counts(level(r.x, r.y)) += 1;
    below(i) = counts(i);
    below(up) += below(up - 1);
    beside(i) = 0.0f;
    beside(level(r.x, r.y)) += source(r.x + 1, r.y);
    out(i) = cast<float>(below(i)) + beside(i) / max(counts(i), 1);
    out.bound(i, 0, 64);
  }
  Source source;
  Var i{"i"};
  Func counts{"counts"}, below{"below"}, beside{"beside"}, out{"out"};
};

bool adds_parts(const Func& f) {
  const std::vector<graph::Dim>& loops = f.function()->updates[0].schedule.dims;
  return f.function()->updates[0].rvars.size() == 1 && loops.front().runs == ForType::Vectorized;
}

TEST(ScattersToFewElements, HavePrivateParts) {
  Scheduled<Histograms> histograms;
  EXPECT_TRUE(adds_parts(histograms.program.counts));
  EXPECT_TRUE(adds_parts(histograms.program.beside));
  histograms.expect_same_values({64});
}

// A layer of a network: a tile of sums reads its input through a boundary condition, many times.
using Boundary = Func (*)(const Func&, const Region&);
Func zeros_around(const Func& f, const Region& box) {
  return BoundaryConditions::constant_exterior(f, 0.0f, box);
}

struct TiledLayer {
  Boundary boundary = zeros_around;
  int step = 1, apart = 1, taps = 3, outputs = 8;
  bool has_known_sizes = true;
  AutoscheduleOptions options = {};
};

class RowCopies : public ::testing::Test {
 protected:
  static constexpr int planes = 6;

  // A layer over `image` and the weights, with sizes known at compile time or only at run time.
  Func layer_of(const TiledLayer& layer, ImageParam& image, ImageParam& weights) {
    Var x("x"), y("y"), c("c");
    const Func source = lambda(x, y, c, image(x, y, c));
    const Func padded = layer.boundary(
        source, {{0, image.dim(0).extent()}, {0, image.dim(1).extent()}, {Expr(), Expr()}});
    const RDom r(0, layer.taps, 0, layer.taps, 0,
                 layer.has_known_sizes ? Expr(planes) : image.dim(2).extent());
    Func result("layer");
    const auto place = [&](const Expr& at, const Expr& tap) {
      return at * layer.step + (tap - layer.taps / 2) * layer.apart;
    };
    result(x, y, c) = 0.5f;
    result(x, y, c) += weights(r.x, r.y, r.z, c) * padded(place(x, r.x), place(y, r.y), r.z);
    return result;
  }

  // Returns the log of the layer's schedule, and checks its values against the unscheduled layer,
  // also for sizes with tails.
  std::string log_of(const TiledLayer& layer) {
    ImageParam image(Float(32), 3, "image"), weights(Float(32), 4, "weights");
    const Func plain = layer_of(layer, image, weights);
    Func scheduled = layer_of(layer, image, weights);
    if (layer.has_known_sizes) scheduled.set_estimates({{0, 48}, {0, 64}, {0, layer.outputs}});
    Pipeline pipeline(scheduled);
    schedule_by_rules(pipeline, get_host_target(), layer.options);
    for (const auto& [width, height] : {std::pair{48, 64}, std::pair{37, 13}, std::pair{1, 2}}) {
      image.set(some_values({width, height, planes}));
      weights.set(some_values({layer.taps, layer.taps, planes, layer.outputs}));
      const std::vector<int> sizes = {(width + layer.step - 1) / layer.step,
                                      (height + layer.step - 1) / layer.step, layer.outputs};
      const Buffer<float> found = pipeline.realize(sizes)[0];
      const Buffer<float> expected = Func(plain).realize(sizes);
      int wrong = 0;
      expected.for_each_element([&](const int* at) {
        wrong += std::abs(found(at) - expected(at)) > 1e-4f * (1 + std::abs(expected(at)));
      });
      EXPECT_EQ(wrong, 0) << width << " x " << height;
    }
    return pipeline.schedule_log().to_text();
  }

  bool copies(const TiledLayer& layer) {
    return log_of(layer).find("_in_layer") != std::string::npos;
  }

 private:
  static Buffer<float> some_values(const std::vector<int>& sizes) {
    Buffer<float> values(sizes);
    for (size_t i = 0; i < values.number_of_elements(); ++i)
      values.data()[i] = static_cast<float>((i * 37 + i / 11) % 29) * 0.0625f - 0.75f;
    return values;
  }
};

TEST_F(RowCopies, OfWhatTilesReadThroughZerosAround) {
  EXPECT_TRUE(copies({}));
  EXPECT_TRUE(copies({.has_known_sizes = false}));
}
TEST_F(RowCopies, OfOtherTaps) {
  EXPECT_TRUE(copies({.apart = 2}));
  EXPECT_TRUE(copies({.taps = 5}));
}
TEST_F(RowCopies, OfOtherBoundaries) {
  EXPECT_TRUE(
      copies({.boundary = [](const Func& f,
                             const Region& box) { return BoundaryConditions::repeat_edge(f, box); },
              .outputs = 16}));
  EXPECT_TRUE(copies(
      {.boundary = [](const Func& f,
                      const Region& box) { return BoundaryConditions::mirror_image(f, box); },
       .outputs = 16}));
}
// One tap: each tile reads an element once, and there are few tiles.
TEST_F(RowCopies, NotOfWhatFewTilesRead) {
  EXPECT_FALSE(copies({.taps = 1}));
  EXPECT_FALSE(copies({.taps = 1, .has_known_sizes = false}));
}
TEST_F(RowCopies, NotWhereTheirDecisionIsSwitchedOff) {
  EXPECT_FALSE(copies({.options = {.without = {Decision::LayoutStaging}}}));
}

// ---- long programs for each point ----

const std::vector<graph::Split>& splits_of(const Func& f) {
  return f.function()->pure->schedule.splits;
}
int64_t lanes_of(const Func& f) {
  return splits_of(f).empty() ? 0 : *ir::as_const_int(splits_of(f)[0].factor);
}
bool runs_in_parallel(const Func& f) {
  return std::any_of(loops_of(f).begin(), loops_of(f).end(),
                     [](const graph::Dim& loop) { return loop.runs == ForType::Parallel; });
}

constexpr int points = 50000;

// A chain of Tuples, each of which reads the five values of the one before at several places of its expressions.
struct TupleChain {
  explicit TupleChain(int steps) {
    const Expr u = cast<float>(i % 97) * 0.01f;
    chain.emplace_back("first");
    chain[0](i) = {u, 1.0f - u, u * u, u + 2.0f, 0.5f * u};
    for (int k = 0; k < steps; ++k) {
      const Func last = chain.back();
      const auto at = [&](int value) -> Expr { return last(i)[value]; };
      chain.emplace_back("step");
      const Expr length = sqrt(at(0) * at(0) + at(1) * at(1) + 1.0f);
      chain.back()(i) = {at(1) / length, at(2) / length + at(0), at(3) / length, at(4) / length,
                         at(0) / length + 0.1f};
    }
    out(i) = chain.back()(i)[0] + chain.back()(i)[4];
    out.set_estimate(i, 0, points);
  }
  Var i{"i"};
  std::vector<Func> chain;
  Func out{"out"};
};

TEST(LongProgram, WhatOneStageReadsAtOneElementIsInlined) {
  TupleChain program(10), plain(10);
  schedule_by_rules(Pipeline(program.out));
  for (const Func& f : program.chain)
    EXPECT_NE(f.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Root) << f.name();
  // Ten levels of five values would make ten million nodes if these did not share what they read.
  for (Func& f : plain.chain) f.compute_root();
  const Buffer<float> found = program.out.realize({points}), expected = plain.out.realize({points});
  for (int k = 0; k < points; ++k) ASSERT_NEAR(found(k), expected(k), 1e-5f) << k;
}

TEST(LongProgram, TheOnlyLoopRunsInParallelPieces) {
  TupleChain program(2);
  schedule_by_rules(Pipeline(program.out));
  EXPECT_TRUE(runs_in_parallel(program.out));
  Func cheap("cheap");
  cheap(program.i) = program.i + 1;
  cheap.set_estimate(program.i, 0, 1000);
  schedule_by_rules(Pipeline(cheap));
  EXPECT_FALSE(runs_in_parallel(cheap));
}

TEST(LongProgram, LongChainsRunInSeveralVectorsAtOnce) {
  const Var i("i");
  const auto lanes_with = [&](int steps) {
    Expr at = cast<float>(i);
    for (int k = 0; k < steps; ++k) at = sqrt(at * at + 2.0f) / (at + 3.0f);
    Func out("out");
    out(i) = at;
    out.set_estimate(i, 0, points);
    schedule_by_rules(Pipeline(out));
    return lanes_of(out);
  };
  EXPECT_EQ(lanes_with(2), 16) << "iterations overlap";
  EXPECT_GT(lanes_with(40), 16);
}

}  // namespace
}  // namespace retrograde
