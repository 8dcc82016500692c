// Programs in which one term of the cost dominates, with figures that are computed by hand.
#include <gtest/gtest.h>

#include <regex>
#include <utility>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/touch.h"
#include "autoschedule/machine/reference.h"
#include "frontend/data/param.h"
#include "unit/cost/cost_testing.h"

namespace retrograde::planning {
namespace {

constexpr double columns = 4096, rows = 2048, image_bytes = 4 * columns * rows;

struct CostProbes : ::testing::Test {
  CostProbes() {
    for (ImageParam* image : {&in, &other}) {
      image->dim(0).set_estimate(0, 4096);
      image->dim(1).set_estimate(0, 2048);
    }
  }
  // The cost of `out`, whose size is that of the images if nothing else is said.
  Cost cost_of(const std::string& text) {
    if (!std::exchange(is_sized, true)) out.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return priced(out, text);
  }
  // The cost of its update with these loops.
  StageCost update_cost(const std::string& loops) {
    return cost_of("out  root\n  .0  y, x:16, vector x\n  .1  " + loops + "\n").stages[1];
  }
  bool is_sized = false;
  ImageParam in{Float(32), 2, "in"}, other{Float(32), 2, "other"};
  Func out{"out"}, rows_sum{"rows_sum"};
};

// ---- memory ----

TEST_F(CostProbes, ACopyMovesEachLineThreeTimes) {
  out(x, y) = in(x, y);
  const Cost cost = cost_of("out  root  y, x:16, vector x\n");
  ASSERT_EQ(cost.stages.size(), 1u);
  const StageCost& copy = cost.stages[0];
  EXPECT_EQ(copy.bytes.back(), 3 * image_bytes) << "lines that are stored are loaded before";
  EXPECT_NEAR(copy.memory_seconds.back(), 3 * image_bytes / 9 * 1e-9, micro) << "one thread";
  // A store, and a quarter of what goes on beside it.
  const double vector_ns = 0.35 + 0.25 * (0.2 + 0.3);
  EXPECT_NEAR(copy.compute_seconds, columns * rows / 16 * vector_ns * 1e-9, 10 * micro);
  EXPECT_NEAR(copy.seconds, copy.memory_seconds.back() + 0.75 * copy.compute_seconds, 2 * micro);
  EXPECT_EQ(copy.bound_by(), "memory");
}

TEST_F(CostProbes, HalfAVectorMovesHalfTheBytes) {
  out(x, y) = in(x, y) + other(x, y);
  const Cost cost = cost_of("out  root  y, x:8, vector x\n");
  // No less than scalars: a sum, two loads and a store of 0.12, 0.24 and 0.24 ns, of which the loop hides three quarters.
  const double vector_ns = 0.3 + 0.25 * (0.12 + 0.24 + 0.24);
  EXPECT_NEAR(cost.stages[0].compute_seconds, columns * rows / 8 * vector_ns * 1e-9, 10 * micro);
}

TEST_F(CostProbes, ThreadsShareTheBandwidthOfMemory) {
  out(x, y) = in(x, y);
  const Cost cost = cost_of("out  root  parallel y, x:16, vector x\n");
  EXPECT_NEAR(cost.stages[0].memory_seconds.back(), 3 * image_bytes / 18 * 1e-9, micro);
  EXPECT_NEAR(cost.stages[0].launch_seconds, 5 * micro, 0.1 * micro);
}

TEST_F(CostProbes, ThreadsTakeChunksOfAllParallelLoops) {
  out(x, y, c) = exp(in(x, y)) + c;
  out.set_estimate(c, 0, 3);
  const double serial = compute_seconds(cost_of("out  root  c, y, x:16, vector x\n"));
  const double parallel =
      compute_seconds(cost_of("out  root  parallel c, parallel y, x:16, vector x\n"));
  EXPECT_NEAR(parallel / serial, 0.5, 0.01);
}

TEST_F(CostProbes, TheLastRoundOfChunksLeavesAThreadIdle) {
  out(x, y) = exp(in(x, y));
  out.bound(y, 0, 3);
  const double serial = compute_seconds(cost_of("out  root  y, x:16, vector x\n"));
  const double parallel = compute_seconds(cost_of("out  root  parallel y, x:16, vector x\n"));
  EXPECT_NEAR(parallel / serial, 2.1 / 3, 0.01) << "and threads end at different times";
}

TEST_F(CostProbes, SmallDataStayInTheCacheFromCallToCall) {
  out(x, y) = in(x, y);
  out.bound(x, 0, 64).bound(y, 0, 16);
  const Cost cost = cost_of("out  root  y, x:16, vector x\n");
  EXPECT_EQ(memory_bytes(cost), 0);
  EXPECT_EQ(cost.stages[0].bytes[1], 0) << "all of it is in L1";
}

// A sum of three rows of sums of three columns.
struct StencilProbes : CostProbes {
  StencilProbes() {
    rows_sum(x, y) = in(x - 1, y) + in(x, y) + in(x + 1, y);
    out(x, y) = rows_sum(x, y - 1) + rows_sum(x, y) + rows_sum(x, y + 1);
    root = cost_of(out_loops + "rows_sum  root  parallel y, x:16, vector x\n");
    inlined = cost_of(out_loops + "rows_sum  inline\n");
    strips = cost_of(out_loops + "rows_sum  at out/y:32  y, x:16, vector x\n");
    sliding = cost_of(out_loops +
                      "rows_sum  at out/y  store at out/y:32  fold y by 4  y, x:16, vector x\n");
  }
  const std::string out_loops = "out  root  parallel y:32, y, x:16, vector x\n";
  Cost root, inlined, strips, sliding;
};

TEST_F(StencilProbes, RowsThatOverlapAreLoadedOnce) {
  EXPECT_NEAR(memory_bytes(inlined), 3 * image_bytes, 0.01 * image_bytes);
  EXPECT_NEAR(memory_bytes(root), 6 * image_bytes, 0.02 * image_bytes);
  EXPECT_NEAR(memory_bytes(sliding), 3 * image_bytes, 0.01 * image_bytes);
}

TEST_F(StencilProbes, StripsRecomputeTheirBorders) {
  const auto seconds_of = [](const Cost& cost) { return cost.stages[0].compute_seconds; };
  EXPECT_NEAR(seconds_of(strips) / seconds_of(root), 34.0 / 32, 0.02);
  // The first row of a strip computes the whole window. Each row that slides waits for its stores.
  const Machine machine = probed_machine();
  const double waits = rows * slice_iterations * machine.iteration_ns * 1e-9 / machine.threads;
  EXPECT_NEAR((seconds_of(sliding) - waits) / seconds_of(root), 34.0 / 32, 0.02);
  EXPECT_GT(compute_seconds(inlined), compute_seconds(sliding));
}

TEST_F(CostProbes, AWindowMovesByWholeRows) {
  rows_sum(x, y) = exp(in(x, y));
  out(x, y) = rows_sum(x, y - 1) + rows_sum(x, y) + rows_sum(x, y + 1);
  const auto seconds_of = [&](const std::string& strip, const std::string& tail) {
    return cost_of("out  root  y:" + strip + tail + ", y, x:16, vector x\n" +
                   "rows_sum  at out/y  store at out/y:" + strip + "  y, x:16, vector x\n")
        .stages[0]
        .compute_seconds;
  };
  EXPECT_NEAR(seconds_of("640", " GuardWithIf") / seconds_of("512", ""), 1, 0.05);
}

TEST_F(CostProbes, AWindowStaysForIterationsThatNeedNoNewRow) {
  rows_sum(x, y) = exp(in(x, y));
  out(x, y) = rows_sum(x, y / 2) + rows_sum(x, y / 2 + 1);
  const auto cost_at = [&](const std::string& place) {
    return cost_of("out  root  y:512, y, x:16, vector x\nrows_sum  at out/" + place +
                   "  y, x:16, vector x\n")
        .stages[0];
  };
  const StageCost window = cost_at("y  store at out/y:512"), strips = cost_at("y:512");
  EXPECT_NEAR(window.compute_seconds / strips.compute_seconds, 1, 0.05);
  EXPECT_LT(window.bytes.back(), 1.1 * strips.bytes.back());
}

TEST_F(CostProbes, RowsOfAnyLengthComeFromTheHeap) {
  const auto seconds_of = [&](bool is_bounded, bool is_pair, const std::string& place) {
    Func doubled("doubled"), sum("sum");
    const Expr value = in(x, y) * 2;
    doubled(x, y) = is_pair ? Tuple(value, value) : Tuple(value);
    sum(x, y) = Expr(doubled(x, y)[0]) + (is_pair ? Expr(doubled(x, y)[1]) : Expr(0.0f));
    sum.set_estimate(x, 0, 512).set_estimate(y, 0, 2048);
    if (is_bounded) sum.bound(x, 0, 512);
    return priced(sum, "sum  root  y, x:16, vector x\ndoubled  at sum/" + place +
                           "  y, x:16, vector x\n")
        .stages[0]
        .compute_seconds;
  };
  // An allocation takes 400 scalar operations of 0.12 ns.
  const double block = 400 * 0.12e-9;
  EXPECT_NEAR(seconds_of(false, false, "y") - seconds_of(true, false, "y"), rows * block,
              0.1 * micro);
  EXPECT_NEAR(seconds_of(false, true, "y") - seconds_of(true, true, "y"), 2 * rows * block,
              0.1 * micro);
  EXPECT_EQ(seconds_of(false, false, "x:16"), seconds_of(true, false, "x:16")) << "on the stack";
}

// Rows that all together exceed the first cache.
TEST_F(CostProbes, BlocksOfAProducerLeaveAllOfItBehind) {
  rows_sum(x, y) = in(x, y) + in(x, y + 1);
  out(x, y) = rows_sum(x, y) + rows_sum(x, y + 1);
  const auto bytes_of = [&](const std::string& loops) {
    return cost_of("out  root  y:32, y, x:16, vector x\nrows_sum  at out/y:32  " + loops + "\n")
        .stages[1]
        .bytes[1];
  };
  EXPECT_NEAR(bytes_of("y:128, x:128, y, x:16, vector x") / bytes_of("y, x:16, vector x"), 1, 0.1);
}

TEST_F(StencilProbes, StripsAreFasterThanTheDetourThroughMemory) {
  EXPECT_LT(sliding.seconds, 0.7 * root.seconds);
  EXPECT_LT(sliding.seconds, strips.seconds);
}

TEST_F(StencilProbes, ThePeakIsWhatIsAliveAtOnce) {
  EXPECT_NEAR(root.peak_bytes, 4 * columns * (rows + 2), 1);
  EXPECT_EQ(inlined.peak_bytes, 0);
  EXPECT_EQ(strips.peak_bytes, 2 * 4 * columns * 34) << "of each thread";
  EXPECT_EQ(sliding.peak_bytes, 2 * 4 * columns * 4);
}

// Lowering computes an output as soon as all that it reads is there, whatever the order of the outputs.
TEST_F(CostProbes, OneImageIsAliveAtOnce) {
  Func second("second"), third("third"), other_rows("other_rows");
  rows_sum(x, y) = in(x, y) + in(x, y + 1);
  other_rows(x, y) = other(x, y) + other(x, y + 1);
  out(x, y) = rows_sum(x, y) + 1.0f;
  second(x, y) = other_rows(x, y) + 1.0f;
  third(x, y) = rows_sum(x, y) * 2.0f;
  for (Func* f : {&out, &second, &third}) f->set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
  const Cost cost = Pricing({out, second, third}, probed_machine())
                        .price(
                            "out  root\nsecond  root\nthird  root\nrows_sum  root\n"
                            "other_rows  root\n");
  EXPECT_EQ(cost.peak_bytes, image_bytes);
}

TEST_F(CostProbes, ATransposeLoadsALineForEachElement) {
  out(x, y) = in(y, x);
  in.dim(0).set_estimate(0, 2064);  // rows in different sets
  in.dim(1).set_estimate(0, 4096);
  const StageCost rows_first = cost_of("out  root  y, x:16, vector x\n").stages[0];
  const StageCost tiles = cost_of("out  root  y:16, x:16, y, vector x\n").stages[0];
  EXPECT_GT(rows_first.bytes[1], 14 * image_bytes)
      << "4096 lines do not stay in L1 until the next row";
  EXPECT_LT(tiles.bytes[1], image_bytes) << "beside what comes from memory";
  EXPECT_EQ(rows_first.bytes.back(), 3 * image_bytes);
}

// 64 passes over two rows that L2 has no room for.
TEST_F(CostProbes, ACacheThatIsTooSmallKeepsAPart) {
  const auto passes_behind = [&](int width) {
    ImageParam row(Float(32), 1, "row"), weights(Float(32), 1, "weights");
    row.dim(0).set_estimate(0, width);
    weights.dim(0).set_estimate(0, width);
    Func sums("sums");
    RDom r(0, width, "r");
    sums(y) = 0.0f;
    sums(y) += row(r) * weights(r);
    sums.bound(y, 0, 64);
    const Cost cost = priced(sums, "sums  root\n  .0  y\n  .1  racing  y, r.x:16, vector r.x\n");
    return cost.stages[1].bytes[2] / (2.0 * 4 * width);
  };
  EXPECT_LT(passes_behind(1 << 16), 1);
  // 1 MB in a cache of which 0.8 MB can be used: m = 1 - exp(-1.25 m) of the lines are lost, which is 0.371.
  EXPECT_NEAR(passes_behind(1 << 17), 1 + 63 * 0.371, 0.5);
  EXPECT_NEAR(passes_behind(1 << 19), 64, 0.5) << "4 MB";
}

// Sixteen rows whose lines are all in one set of L1.
TEST_F(CostProbes, RowsThatShareSetsEvictEachOther) {
  const auto lines_of = [&](int width) {
    Func copy("copy");
    copy(x, y) = in(x, y);
    copy.set_estimate(x, 0, width).set_estimate(y, 0, 512);
    in.dim(0).set_estimate(0, width);
    in.dim(1).set_estimate(0, 512);
    const Cost cost = priced(copy, "copy  root  y:16, x, vector y\n");
    return cost.stages[0].bytes[1] / (width * 512);
  };
  EXPECT_GT(lines_of(1024), 5 * lines_of(1040));
}

TEST_F(CostProbes, CopiesLoadOnceWhatTheyShare) {
  Func copy("copy");
  copy(x, y, c) = in(x, y) * c;
  copy.set_estimate(x, 0, 1024).set_estimate(y, 0, 512).bound(c, 0, 4);
  in.dim(0).set_estimate(0, 1024);
  in.dim(1).set_estimate(0, 512);
  const Cost cost = priced(copy, "copy  root  (y, x, c)  y:16, x, unroll c, vector y\n");
  const double lines_bytes = 64 * 1024 * 512;  // one for each element, as sixteen rows share a set
  EXPECT_NEAR(cost.stages[0].bytes[1], lines_bytes, 0.1 * lines_bytes);
}

// 64 rows of 256 bytes. 4112 bytes apart, they begin in 1008 bytes of sets and end 256 bytes later.
TEST(Touch, RowsALittleApartShareSets) {
  Touch touch;
  touch.sides.resize(2);
  for (int16_t d = 0; d < 2; ++d) {
    touch.sides[static_cast<size_t>(d)].moves = {{d, 1}};
    touch.sides[static_cast<size_t>(d)].most = 64;
  }
  const auto bytes_of = [&](double width) {
    return bytes_by_sets(touch, {{0, 1}, {width, 64}}, {64, 64}, page_bytes);
  };
  EXPECT_EQ(bytes_of(1024), 64 * page_bytes);
  EXPECT_EQ(bytes_of(1028), 64.0 * 256 / (1008 + 256) * page_bytes);
  EXPECT_EQ(bytes_of(1088), 64 * 256) << "all sets";
  touch.sides[0].data = touch.data = set_of(0);
  touch.moved = set_of(0) | set_of(1);
  EXPECT_EQ(bytes_of(1024), 0) << "a table may be read anywhere";
  touch.sides[0].is_displaced = true;
  EXPECT_EQ(bytes_of(1024), 64 * page_bytes) << "rows are where they are";
}

// 16 KB that lie together, read for each eight rows that share sets: 64 times.
TEST_F(CostProbes, RowsThatShareSetsLeaveOtherSetsAlone) {
  RDom k(0, 64, "k");
  out(x, y) += in(k, y) * other(x, k);
  in.dim(0).set_estimate(0, 1024);
  other.dim(0).set_estimate(0, 64);
  other.dim(1).set_estimate(0, 64);
  out.bound(x, 0, 64).bound(y, 0, 512);
  is_sized = true;
  const StageCost cost = update_cost("y:8, x:16, k.x, unroll y, vector x");
  const double rows_bytes = 8 * 64 * 4, out_bytes = 512 * 64 * 4;
  EXPECT_EQ(cost.bytes[1], 64 * 4 * rows_bytes + 2 * out_bytes) << "the rows for each vector";
}

// Columns of vectors: each iteration jumps to another row of both images.
TEST_F(CostProbes, LinesThatNothingFetchesAheadTakeLonger) {
  out(x, y) = in(x, y);
  in.dim(1).set_estimate(0, 1024);
  out.set_estimate(x, 0, 4096).set_estimate(y, 0, 1024);
  is_sized = true;
  const auto memory_ns = [&](const std::string& loops) {
    return 1e9 * cost_of("out  root  " + loops + "\n").stages[0].all_memory_seconds();
  };
  const double lines = 2 * columns * 1024 / 16, rows_ns = memory_ns("y, x:16, vector x");
  EXPECT_NEAR(memory_ns("y:16, x:16, y, vector x"), rows_ns, 0.05 * rows_ns) << "16 streams each";
  const double waiting_ns = lines * (far_line_ns[0] + far_line_ns[1]);
  EXPECT_NEAR(memory_ns("x:16, y, vector x"), rows_ns + waiting_ns, 0.05 * rows_ns);
  const double late_ns = lines * (far_line_ns[0] / 2 + far_line_ns[1]);
  EXPECT_NEAR(memory_ns("x:32, y, x:16, vector x"), rows_ns + late_ns, 0.05 * rows_ns)
      << "L2 has not noticed the stream before it ends";
  EXPECT_LT(memory_ns("x:256, y, x:16, vector x"), rows_ns + 0.2 * waiting_ns)
      << "sixteen lines of each row";
}

// The same with more rows than the processor remembers addresses of pages.
TEST_F(CostProbes, ColumnsOfManyPagesLookThemUp) {
  out(x, y) = in(x, y);
  const StageCost cost = cost_of("out  root  x:16, y, vector x\n").stages[0];
  const double lines = 2 * columns * rows / 16;
  EXPECT_GT(cost.all_memory_seconds(), lines * (page_walk_ns + far_line_ns[0]) * 1e-9);
}

// Sixteen rows whose lines are all in one set of L1, with one element of each at a time.
TEST_F(CostProbes, StoresToEvictedLinesWait) {
  const auto ns_of = [&](int width, int height) {
    Func copy("copy");
    copy(x, y) = 1.0f;
    copy.set_estimate(x, 0, width).set_estimate(y, 0, 1024);
    const std::string lanes = std::to_string(height);
    const Cost cost = priced(copy, "copy  root  y:" + lanes + ", x, vector y\n");
    return 1e9 * cost.seconds / (width * 1024);
  };
  EXPECT_GT(ns_of(1024, 16), 15.0 / 16 * evicted_store_ns);
  EXPECT_LT(ns_of(1024, 4), 2);
  EXPECT_LT(ns_of(1040, 16), 2);
}

// Rows of a recurrence along x wait for nothing but themselves, whether a read of the same row is clamped or not.
TEST_F(CostProbes, AClampOfTheSameRowCarriesNothing) {
  RDom r(1, 4095, 0, 2048, "r");
  const auto chain_of = [&](const Expr& row) {
    Func scan("scan");
    scan(x, y) = in(x, y);
    scan(r.x, r.y) += scan(r.x - 1, row) * 0.5f;
    scan.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return priced(scan, "scan  root\n  .0  y, x:16, vector x\n  .1  r.y:8, r.x, unroll r.y\n")
        .stages[1]
        .compute_seconds;
  };
  EXPECT_NEAR(chain_of(clamp(r.y, 0, 2047)) / chain_of(r.y), 1, 0.01);
}

// The conditions of borders hold for all but a few iterations.
TEST_F(CostProbes, ConditionsOfBordersAreFree) {
  const auto seconds_of = [&](bool is_masked) {
    Func sum("sum");
    RDom r(0, 64, "r");
    if (is_masked) r.where(likely(x > 2) && likely(y > 2) && likely(x < 4000));
    sum(x, y) += in(x, y + r);
    sum.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return priced(sum, "sum  root\n  .0  y, x:16, vector x\n  .1  y, r.x, x:16, vector x\n")
        .stages[1]
        .compute_seconds;
  };
  EXPECT_NEAR(seconds_of(true) / seconds_of(false), 1, 0.01);
}

// ---- arithmetic ----

TEST_F(CostProbes, FunctionsCountByVectors) {
  out(x, y) = exp(in(x, y));
  const double seconds = compute_seconds(cost_of("out  root  y, x:16, vector x\n"));
  EXPECT_NEAR(seconds, columns * rows / 16 * (4 + 0.25 * 0.85) * 1e-9, 0.02 * seconds);
}

// Registers hold the vectors of a small array only if all loads are of the vectors that were stored.
TEST_F(CostProbes, ShiftedVectorsComeFromMemory) {
  rows_sum(x, y) = in(x, y) * 2;
  const auto loads_of = [&](const Expr& value) {
    Func sum("sum");
    sum(x, y) = value;
    sum.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    const Cost cost = priced(sum,
                             "sum  root  y, x:16, vector x\n"
                             "rows_sum  at sum/x:16  y, unroll x:16, vector x\n");
    return cost.stages[1].compute_seconds;
  };
  EXPECT_GT(loads_of(rows_sum(x, y) + rows_sum(x + 1, y)),
            loads_of(rows_sum(x, y) + 1) + columns * rows / 16 * 0.4e-9);
}

// A border cuts a box that clamped reads need, so that nothing but memory has its size: each slice is waited for.
TEST_F(CostProbes, ClampedReadsComeFromMemory) {
  rows_sum(x, y) = in(x, y) * 2;
  const auto ns_of_slice = [&](const Expr& place) {
    Func shifted("shifted");
    shifted(x, y) = rows_sum(place, y) + 1;
    shifted.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    const Cost cost = priced(shifted,
                             "shifted  root  y, x:16, vector x\n"
                             "rows_sum  at shifted/x:16  y, unroll x:16, vector x\n");
    return 1e9 * compute_seconds(cost) / (columns * rows / 16);
  };
  EXPECT_LT(ns_of_slice(x), 3);
  EXPECT_GT(ns_of_slice(clamp(x, 0, 4000)), slice_iterations * 0.3);
}

// Rows of 4100 elements: most vectors cross a line, so that a load counts twice. Stores take 0.35 ns, an iteration 0.3 ns.
TEST_F(CostProbes, RowsOfOddLengthShiftTheirVectors) {
  const auto ns_of = [&](int length) {
    ImageParam image(Float(32), 2, "image");
    image.dim(0).set_estimate(0, length);
    Func copy("copy");
    copy(x, y) = image(x, y);
    copy.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    const Cost cost = priced(copy, "copy  root  y, x:16, vector x\n");
    return 1e9 * compute_seconds(cost) / (columns * rows / 16);
  };
  EXPECT_NEAR(ns_of(4096), 0.35 + 0.25 * (0.2 + 0.3), 0.01);
  EXPECT_NEAR(ns_of(4100), 0.4 + 0.25 * (0.35 + 0.3), 0.01);
}

// Lowering gives whole blocks to a border, and loads their elements one by one.
TEST_F(CostProbes, ABorderIsABlock) {
  out(x, y) = in(clamp(x - 1, 0, 4095), y) + in(clamp(x + 1, 0, 4095), y);
  const double vectors = compute_seconds(cost_of("out  root  y, x:16, vector x\n"));
  const double blocks = compute_seconds(cost_of("out  root  y, x:1024, unroll x:16, vector x\n"));
  const double loops = compute_seconds(cost_of("out  root  y, x:1024, x:16, vector x\n"));
  EXPECT_GT(blocks, 2 * vectors) << "half of the points are in the blocks of the borders";
  EXPECT_NEAR(loops / vectors, 1, 0.05);
}

// Two of four blocks are at the ends of a row. There, a clamp cuts the box, and the copies of the tile run behind
// conditions, which doubles their time.
TEST_F(CostProbes, TilesThatABorderCutsTakeTwiceAsLong) {
  const auto seconds_of = [&](int end) {
    RDom r(0, 64, "r");
    Func sum("sum"), all("all");
    sum(x, y) += in(x, r) * other(r, y);
    all(x, y) = sum(min(x, end), y);
    all.bound(x, 0, 4096).set_estimate(y, 0, 2048);
    const Cost cost = priced(all,
                             "all  root  y, x:1024, x:16, vector x\n"
                             "sum  at all/x:1024\n"
                             "  .0  y, x:16, vector x\n"
                             "  .1  y, x:64, r.x, unroll x:16, vector x\n");
    return cost.stages[1].compute_seconds;
  };
  EXPECT_NEAR(seconds_of(4094) / seconds_of(4095), 1.5, 0.05);
}

// A transposed convolution of stride 2: the lanes of a phase of x share a weight, and load neighbours. Without phases, each
// copy of a tile mixes the products of its even and odd lanes.
TEST_F(CostProbes, PhasesSpareInterleavedProducts) {
  const auto ns_of = [&](const std::string& outer, const std::string& lanes, bool is_scaled) {
    RDom r(0, 64, 0, 2, "r");
    const Expr at = is_scaled ? (x + 1) / 2 - r.y : x - r.y;
    const Expr tap = is_scaled ? r.y * 2 + (x + 1) % 2 : r.y;
    Func sum("sum");
    sum(x, c) += in(at, r.x) * other(tap, c);
    sum.set_estimate(x, 0, 4096).set_estimate(c, 0, 4);
    const Cost cost = priced(sum, "sum  root\n  .0  c, x:16, vector x\n  .1  " + outer +
                                      ", r.x, r.y, unroll c, " + lanes + "\n");
    return 1e9 * cost.stages[1].compute_seconds / (columns / 16 * 4 * 64 * 2);
  };
  const double plain = ns_of("x:16", "vector x", false);
  const double phases = ns_of("x:32", "unroll x%2, vector x:2", true);
  EXPECT_LT(phases, 1.5 * plain);
  EXPECT_LT(phases, 0.8);
  EXPECT_GT(ns_of("x:16", "vector x", true), 3 * 0.45);
}

// Loops that end where the clamp does cross no border, whether it has one end or two.
TEST_F(CostProbes, AClampThatNoPointReachesIsFree) {
  const auto seconds_of = [&](const Expr& column) {
    Func copy("copy");
    copy(x, y) = in(column, y);
    copy.bound(x, 0, 4096).set_estimate(y, 0, 2048);
    return compute_seconds(priced(copy, "copy  root  y, x:16, vector x\n"));
  };
  const double plain = seconds_of(x);
  EXPECT_NEAR(seconds_of(min(x, 4095)), plain, 0.01 * plain);
  EXPECT_NEAR(seconds_of(clamp(x, 0, 4095)), plain, 0.01 * plain);
  EXPECT_GT(seconds_of(min(x, 4094)), 1.01 * plain);
}

// 48 sums exceed 32 registers: each iteration loads and stores all of them. Of 32, it does the two that operands displace.
TEST_F(CostProbes, SumsBeyondTheRegistersStayInMemory) {
  const auto ns_of = [&](const std::string& height) {
    RDom r(0, 1024, "r");
    Func sum("sum");
    sum(x, y) += in(x, r) * other(y, r);
    sum.bound(x, 0, 4096).bound(y, 0, 48);
    const Cost cost = priced(sum, "sum  root\n  .0  y, x:16, vector x\n  .1  y:" + height +
                                      ", x:64, r.x, unroll y, unroll x:16, vector x\n");
    return 1e9 * cost.stages[1].compute_seconds / (columns * 48 / 16 * 1024);
  };
  EXPECT_GT(ns_of("12"), 0.35) << "a store for each sum";
  EXPECT_LT(ns_of("8"), 0.35);
}

TEST_F(CostProbes, SumsOfTwoStagesInALoopStayInMemory) {
  RDom r(0, 1024, "r");
  Func second("second");
  out(x, y) += in(x, r) * other(y, r);
  second(x, y) += in(x, r) * other(y, r + 1);
  for (Func* sum : {&out, &second}) sum->bound(x, 0, 4096).bound(y, 0, 48);
  const std::string zeros = "  root\n  .0  y, x:16, vector x\n  .1  ",
                    loops = "y:8, x:16, r.x, unroll y, vector x\n";
  const auto ns_of = [&](const std::string& shared) {
    const Cost cost =
        Pricing({out, second}).price("out" + zeros + loops + "second" + zeros + shared + loops);
    return 1e9 * cost.stages[3].compute_seconds / (columns * 48 / 16 * 1024);
  };
  EXPECT_LT(ns_of(""), 0.35);
  EXPECT_GT(ns_of("shared with out.1/r.x  "), 0.35) << "a store for each sum";
}

TEST_F(CostProbes, WhatALoopDoesNotChangeIsComputedOutsideOfIt) {
  out(x, y) = in(x, y) + exp(other(0, y));
  const double once = compute_seconds(cost_of("out  root  y, x:16, vector x\n"));
  const double each = compute_seconds(cost_of("out  root  x:16, y, vector x\n"));
  EXPECT_LT(once, columns * rows / 16 * 0.7e-9);
  EXPECT_GT(each, columns * rows / 16 * 4e-9);
}

TEST_F(CostProbes, UnrolledCopiesShareAFunctionUnlessItIsInAnArm) {
  const auto seconds = [&](const Expr& value) {
    Func sum("sum");
    sum(x, y) = value + other(x, y);
    sum.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return compute_seconds(priced(sum, "sum  root  y:4, x:16, unroll y, vector x\n"));
  };
  const double vectors = columns * rows / 16;
  const double shared = seconds(exp(in(x, 0)));
  const double in_arm = seconds(select(in(x, 0) > 0, exp(in(x, 0)), 0));
  EXPECT_LT(shared, vectors * 2e-9);
  EXPECT_NEAR(in_arm - shared, vectors * 3e-9, vectors * 0.4e-9);
  // The select chooses between values of a function that both of its arms use.
  const Expr both = exp(in(x, 0));
  EXPECT_NEAR(seconds(select(in(x, 0) > 0, both * 2.f, both)), shared, vectors * 0.4e-9);
}

// Copies for each component store three vectors, load two and add once.
TEST_F(CostProbes, CopiesKnowTheArmOfASelect) {
  Func f("f");
  const Expr both = in(x, y) + other(x, y);
  f(x, y, c) = select(c == 0, in(x, y), c == 1, other(x, y), both);
  f.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048).bound(c, 0, 3);
  const double vectors = columns * rows / 16;
  const double ns = 1e9 * compute_seconds(priced(f, "f  root  y, x:16, unroll c, vector x\n"));
  EXPECT_NEAR(ns / vectors, 3 * 0.35 + 0.25 * (2 * 0.2 + 0.2 + 0.3), 0.02);
}

TEST_F(CostProbes, AParallelIterationBeginsWithACall) {
  out(x, y) = in(x, y);
  const auto seconds = [&](const std::string& loops) {
    return compute_seconds(cost_of("out  root  parallel y, " + loops + ", vector x\n"));
  };
  const double calls = columns * rows / 16;
  EXPECT_NEAR(seconds("parallel x:16") - seconds("x:16"), calls / 2 * task_ns * 1e-9, 40 * micro);
}

// A vector has 40 gathers, each of 16 lanes of three instructions, which take 14 KB. Two copies fit into 32 KB.
TEST_F(CostProbes, BodiesBeyondTheCacheOfInstructionsAreFetched) {
  ImageParam places(Int(32), 2, "places"), table(Float(32), 1, "table");
  table.dim(0).set_estimate(0, 1024);
  Expr sum = 0.f;
  for (int i = 0; i < 40; ++i) sum += table(clamp(places(x, y), 0, 900) + i);
  out(x, y) = sum;
  const auto vector_ns = [&](const std::string& copies) {
    const std::string loops = "y:" + copies + ", x:16, unroll y, vector x\n";
    return 1e9 * compute_seconds(cost_of("out  root  " + loops)) / (columns * rows / 16);
  };
  EXPECT_GT(vector_ns("2"), 40 * 16 * 0.35);
  EXPECT_NEAR(vector_ns("4") - vector_ns("2"), 0.25 * 40 * 48 * 7 / 64, 2);
}

// Two loops, and two loads, a sum and a store for each copy.
TEST_F(CostProbes, CodeGrowsWithItsCopies) {
  out(x, y) = in(x, y) + in(x, y + 1);
  EXPECT_EQ(cost_of("out  root  y, x:16, vector x\n").code, 2 * code_of_loop + 4);
  EXPECT_EQ(cost_of("out  root  y:4, x:16, unroll y, vector x\n").code, 2 * code_of_loop + 16);
}

// Rows of 16 KB: lowering keeps four of a window over three rows, whatever the height of the strip.
TEST_F(CostProbes, AWindowKeepsAFewRowsOfAStrip) {
  rows_sum(x, y) = in(x, y) + in(x + 1, y);
  out(x, y) = rows_sum(x, y) + rows_sum(x, y + 2);
  const auto in_strips_of = [&](const std::string& height) {
    return cost_of("out  root  y:" + height +
                   ", y, x:16, vector x\nrows_sum  at out/y  store at out/y:" + height +
                   "  y, x:16, vector x\n");
  };
  const Cost low = in_strips_of("64"), high = in_strips_of("512");
  EXPECT_NEAR(low.peak_bytes, 4 * 16384, 1024);
  EXPECT_EQ(high.peak_bytes, low.peak_bytes);
  EXPECT_LT(high.seconds, low.seconds) << "fewer rows at the ends of strips";
}

TEST_F(CostProbes, InlinedFuncsAreComputedForEachElement) {
  rows_sum(x, y) = exp(in(x, y));
  out(x, y) = rows_sum(x, y) + rows_sum(x + 1, y);
  const double one =
      compute_seconds(cost_of("out  root  y, x:16, vector x\nrows_sum  root  y, x:16, vector x\n"));
  const double two = compute_seconds(cost_of("out  root  y, x:16, vector x\nrows_sum  inline\n"));
  EXPECT_NEAR(two / one, 2 - 0.85 / 4, 0.2) << "a load and a store less";
}

TEST_F(CostProbes, InnermostLoopsBecomeVectorsByThemselves) {
  out(x, y) = exp(in(x, y));
  const double vectors = compute_seconds(cost_of("out  root  y, x:16, vector x\n"));
  EXPECT_NEAR(compute_seconds(cost_of("out  root  y, x\n")), remainder_overhead * vectors,
              0.01 * vectors);
  EXPECT_GT(compute_seconds(cost_of("out  root  x, y\n")), 10 * vectors) << "strided stores";
}

// 200 products with minima are 800 nodes with their operands, and so are two copies of 100.
TEST_F(CostProbes, LargeBodiesStayScalar) {
  const auto slowdown = [&](int products, const std::string& scalar) {
    Func large("large");
    Expr value = in(x, y);
    for (int i = 0; i < products; ++i) value = min(value, 3.f) * value;
    large(x, y) = value;
    large.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    const auto seconds = [&](const std::string& loops) {
      return compute_seconds(priced(large, "large  root  " + loops + "\n"));
    };
    return seconds(scalar) / seconds("y, x:16, vector x");
  };
  EXPECT_NEAR(slowdown(100, "y, x"), remainder_overhead, 0.05);
  EXPECT_GT(slowdown(200, "y, x"), 9);
  EXPECT_GT(slowdown(100, "y:2, x, unroll y"), 9);
}

// One of twenty additions waits for the one before, through memory: 2.5 ns instead of what the others take.
TEST_F(CostProbes, AdditionsToOneBinWaitForEachOther) {
  RDom r(0, 4096, 0, 2048, "r");
  Func bins("bins");
  bins(x) += 1;
  bins(clamp(cast<int>(in(r.x, r.y)), 0, 255)) += 1;
  bins.bound(x, 0, 256);
  const auto seconds = [&](const std::string& loops, double latency_ns) {
    Machine machine = probed_machine();
    machine.memory_latency_ns = latency_ns;
    const std::string root = "bins  root\n  .0  x\n  .1  x\n  .2  ";
    return priced(bins, root + loops + "\n", machine).stages[2].compute_seconds;
  };
  for (const char* loops : {"r.y, r.x", "racing  r.y, r.x:16, vector r.x"}) {
    EXPECT_NEAR(seconds(loops, 2.5), 0.95 * seconds(loops, 0) + 0.05 * columns * rows * 2.5e-9,
                micro);
  }
}

// Elements that lie 4096 bytes apart have the same low bits of addresses.
TEST_F(CostProbes, LoadsWaitForStoresWholePagesApart) {
  const auto seconds_of = [&](int bins) {
    RDom r(0, 4096, 0, 2048, "r");
    Func sums("sums");
    sums(x, c) += in(x, c);
    sums(clamp(cast<int>(in(r.x, r.y)), 0, bins - 1), c) += 1.f;
    sums.bound(x, 0, bins).bound(c, 0, 2);
    const Cost cost =
        priced(sums, "sums  root\n  .0  c, x\n  .1  c, x\n  .2  r.y, r.x, unroll c\n");
    return cost.stages[2].compute_seconds;
  };
  EXPECT_NEAR(seconds_of(1024) - seconds_of(1025), columns * rows * 2.5e-9,
              0.1 * columns * rows * 2.5e-9);
}

// A stage that runs along rows stores each line once, whatever the columns of another one in the same loop do.
TEST_F(CostProbes, RowsThatFitAreNotEvicted) {
  RDom r(1, 499, "r");
  Func run("run");
  run(x, y) = in(0, y);
  run(r, y) = run(r - 1, y) * other(r, y);
  run.bound(x, 0, 500).bound(y, 0, 2048);
  const auto first_of = [&](const std::string& strip) {
    return priced(run, "run  root\n  .0  parallel y" + strip + ", y, x:16, vector x\n  .1  " +
                           "shared with run.0/y" + strip + "  parallel y" + strip +
                           ", r.x, unroll y\n")
        .stages[0]
        .seconds;
  };
  EXPECT_NEAR(first_of(":4"), first_of(":16"), 0.2 * first_of(":16"));
}

// Eight rows in lanes: each loads and stores an element of its own, at a place that no vector holds.
TEST_F(CostProbes, StridedLanesNeedNoPlaces) {
  Func copy("copy");
  copy(x, y) = in(x, y);
  copy.bound(x, 0, 500).bound(y, 0, 2048);
  const Cost cost = priced(copy, "copy  root  y:8, x, vector y\n");
  const double loads = 8 * 0.35, stores = 8 * 0.4, loop = 0.3;
  const double vector_ns = 0.7 * stores + 0.25 * (0.7 * loads + loop);
  EXPECT_NEAR(cost.stages[0].compute_seconds, 500 * 256 * vector_ns * 1e-9, 2 * micro);
}

// A slice of one vector and its neighbours.
TEST_F(CostProbes, TheConsumerOfASliceWaitsForIt) {
  rows_sum(x, y) = in(x, y) * 2;
  out(x, y) = rows_sum(x, y) + rows_sum(x + 1, y);
  const auto compute_ns = [&](const std::string& slice) {
    return 1e9 * compute_seconds(cost_of("out  root  y, x:256, x:16, vector x\nrows_sum  at out/" +
                                         slice + "  y, x:16, vector x\n"));
  };
  const double slices = columns * rows / 16, slice_ns = slice_iterations * 0.3;
  EXPECT_GT(compute_ns("x:16"), slices * slice_ns);
  EXPECT_LT(compute_ns("x:256"), slices * (slice_ns / 16 + 2));
}

struct ProductProbes : CostProbes {
  ProductProbes() {
    for (ImageParam* image : {&in, &other}) {
      image->dim(0).set_estimate(0, 256);
      image->dim(1).set_estimate(0, 256);
    }
    out(x, y) = 0.0f;
    out(x, y) += in(k, y) * other(x, k);
    out.bound(x, 0, 256).bound(y, 0, 256);
  }
  static constexpr double products = 256.0 * 256 * 256 / 16;  // in vectors
  RDom k{0, 256, "k"};
};

TEST_F(ProductProbes, ARegisterTileIsBoundByMultiplyAdds) {
  const StageCost cost = update_cost("y:4, x:64, k.x, unroll y, unroll x:16, vector x");
  // Sixteen multiply-adds beside eight loads and one iteration.
  const double iteration_ns = 16 * 0.2 + 0.25 * (8 * 0.2 + 0.3);
  EXPECT_NEAR(cost.compute_seconds, products / 16 * iteration_ns * 1e-9, 50 * micro);
  EXPECT_EQ(cost.bound_by(), "compute");
}

TEST_F(ProductProbes, ASingleSumWaitsForItself) {
  EXPECT_NEAR(update_cost("y, x:16, k.x, vector x").compute_seconds, products * 1.3e-9,
              100 * micro);
}

TEST_F(ProductProbes, LanesMoveTogetherWhateverLoopsAreInside) {
  const StageCost inside = update_cost("y, x:16, k.x, vector x");
  const StageCost around = update_cost("y, x:16, vector x, k.x");
  EXPECT_EQ(around.bytes, inside.bytes);
  EXPECT_EQ(around.compute_seconds, inside.compute_seconds);
}

TEST_F(ProductProbes, ATileThatExceedsTheRegistersSpills) {
  const StageCost fits = update_cost("y:4, x:64, k.x, unroll y, unroll x:16, vector x");
  const StageCost spills = update_cost("y:16, x:64, k.x, unroll y, unroll x:16, vector x");
  EXPECT_GT(spills.compute_seconds, 1.2 * fits.compute_seconds);
}

// ---- chains ----

TEST_F(CostProbes, ASumOfScalarsIsAChain) {
  Func total("total");
  RDom r(0, 1000000, "r");
  total() += in(r, 0);
  const Cost cost = priced(total, "total  root\n  .0\n  .1  r.x\n");
  EXPECT_NEAR(cost.stages[1].compute_seconds, 1.3e-3, 20 * micro);
}

TEST_F(CostProbes, CopiesOfALoopWaitOneAfterTheOther) {
  RDom r(0, 1000000, 0, 2, "r");
  out() += in(r.x, r.y);
  is_sized = true;
  const auto seconds_of = [&](const std::string& loops) {
    return cost_of("out  root\n  .0\n  .1  " + loops + "\n").stages[1].compute_seconds;
  };
  EXPECT_NEAR(seconds_of("r.y, r.x"), 2.6e-3, 40 * micro);
  EXPECT_NEAR(seconds_of("unroll r.y, r.x"), 2.6e-3, 40 * micro);
}

TEST_F(CostProbes, ShortSumsOverlap) {
  RDom r(0, 4, "r");
  out(x, y) = 0.0f;
  out(x, y) += in(x + r, y);
  const double chain = columns * rows / 16 * 4 * 1.3e-9;
  EXPECT_LT(update_cost("y, x:16, r.x, vector x").compute_seconds, chain / 1.2);
}

TEST_F(CostProbes, LanesOfASumAreCombinedOnce) {
  const auto update = [&](int terms) {
    Func total("total");
    RDom r(0, terms, "r");
    total(y) = 0.0f;
    total(y) += in(r, y);
    total.bound(y, 0, 2048);
    return priced(total, "total  root\n  .0  y\n  .1  racing  y, r.x:16, vector r.x\n").stages[1];
  };
  // A shuffle and a sum of 16 lanes for each element, then of 8, of 4, and of 2.
  const double ends = rows * (1 + 0.5 + 0.25 + 0.125) * (0.45e-9 + 0.2e-9);
  EXPECT_GT(update(16).compute_seconds, ends);
  EXPECT_LT(update(16).compute_seconds, 1.5 * ends);
  EXPECT_NEAR(update(4096).compute_seconds, rows * 256 * 1.3e-9, 1.5 * ends) << "hidden";
}

// A single one does through memory; of several, each carries its last element in a register.
TEST_F(CostProbes, ARecurrenceAlongALineWaitsForItself) {
  RDom r(1, 4095, "r");
  out(x, y) = 0.0f;
  out(r, y) = 0.5f * out(r - 1, y) + in(r, y);
  const auto update = [&](const std::string& loops) { return update_cost(loops).compute_seconds; };
  EXPECT_NEAR(update("y, r.x"), 4095 * rows * 2.5e-9, 100 * micro);
  EXPECT_NEAR(update("y:2, r.x, unroll y"), 4095 * rows / 2 * 1.3e-9, 100 * micro);
  EXPECT_LT(update("y:16, r.x, unroll y"), 4095 * rows * 1.5e-9);
  EXPECT_LT(update("y:4, r.x, vector y"), 4095 * rows * 1.2e-9);
  EXPECT_NEAR(update("y:16, r.x, vector y"), 4095 * rows * 2.5e-9, 100 * micro)
      << "16 lines of one set of the first cache";
}

// ---- data-dependent indices ----

// An element of a table at a place that data give, with any value.
Expr looked_up(const Var& column, const Var& row, int elements) {
  ImageParam places(Int(32), 2, "places"), table(Float(32), 1, "table");
  places.dim(0).set_estimate(0, 4096);
  places.dim(1).set_estimate(0, 2048);
  table.dim(0).set_estimate(0, elements);
  return table(clamp(places(column, row), 0, elements - 1));
}

TEST_F(CostProbes, ATableIsReadALineAnElement) {
  out(x, y) = looked_up(x, y, 1 << 26);
  const Cost cost = cost_of("out  root  y, x:16, vector x\n");
  EXPECT_GT(memory_bytes(cost), 4.0 * (1 << 26));
  EXPECT_GT(cost.stages[0].compute_seconds, columns * rows * 0.35e-9);
}

// A table of 4 MB, of which L2 holds a fifth.
TEST_F(CostProbes, EachLookUpInALargeTableIsALine) {
  out(x, y) = looked_up(x, y, 1 << 20);
  const StageCost cost = cost_of("out  root  y, x:16, vector x\n").stages[0];
  EXPECT_NEAR(cost.bytes[2] / (columns * rows), 0.8 * 64, 2);
}

// The lanes of such a vector are a period of the index, or all of them are in one.
TEST_F(CostProbes, LanesOfDividedIndicesAreVectorsIfTheyDivideEvenly) {
  const auto vector_ns = [&](const Expr& index) {
    Func f("f");
    f(x, y) = in(index, y);
    f.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return 1e9 * compute_seconds(priced(f, "f  root  y, x:16, vector x\n")) / (columns * rows / 16);
  };
  const double gather_ns = 16 * 0.35;
  for (const Expr& index : {x / 2, (3 * x + 1) / 6, x / 32, x % 4, x / 2 % 64, x % 512})
    EXPECT_LT(vector_ns(index), 0.3 * gather_ns) << index;
  for (const Expr& index : {x / 3, 2 * x / 3, (4 * x + 3) / 6, x % 500, x / 3 % 64})
    EXPECT_GT(vector_ns(index), gather_ns) << index;
}

// A gather occupies the units that compute its places and use its values.
TEST_F(CostProbes, GathersAreArithmetic) {
  const auto seconds_of = [&](bool has_function) {
    Func f("f");
    const Expr value = in(clamp(cast<int>(x + other(x, y)), 0, 4095), y);
    f(x, y) = has_function ? exp(value) : value;
    f.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
    return compute_seconds(priced(f, "f  root  y, x:16, vector x\n"));
  };
  EXPECT_NEAR(seconds_of(true) - seconds_of(false), columns * rows / 16 * 4e-9, 100 * micro);
}

TEST_F(CostProbes, AnElementOfEachRowIsALine) {
  ImageParam places(Int(32), 1, "places");
  places.dim(0).set_estimate(0, 2048);
  Func f("f");
  f(y) = in(clamp(places(y), 0, 4095), y);
  f.set_estimate(y, 0, 2048);
  EXPECT_LT(priced(f, "f  root  y:16, vector y\n").stages[0].bytes[2], 2 * 64 * rows);
}

TEST_F(CostProbes, ADisplacedImageIsReadAsAWhole) {
  out(x, y) = in(clamp(cast<int>(x + other(x, y)), 0, 4095), y);
  const Cost cost = cost_of("out  root  y, x:16, vector x\n");
  EXPECT_NEAR(memory_bytes(cost), 4 * image_bytes, 0.1 * image_bytes);
  EXPECT_GT(cost.stages[0].compute_seconds, columns * rows * 0.35e-9) << "lane by lane";
}

TEST_F(CostProbes, VectorsAtBordersAreReadLaneByLane) {
  const auto compute_of = [&](int width, int shift) {
    Func f("f");
    f(x, y) = in(clamp(x + shift, 0, width - 1), y);
    f.bound(x, 0, width).set_estimate(y, 0, 2048);
    return compute_seconds(priced(f, "f  root  y, x:16, vector x\n"));
  };
  EXPECT_GT(compute_of(64, 1), 2 * compute_of(64, 0)) << "each second vector is at a border";
  EXPECT_LT(compute_of(4096, 1), 1.2 * compute_of(4096, 0));
}

TEST_F(CostProbes, ARotatedImageIsReadInManyLinesAVector) {
  Param<float> angle("angle");
  const Expr u = cast<int>(angle * x + y), v = cast<int>(x - angle * y);
  out(x, y) = in(clamp(u, 0, 4095), clamp(v, 0, 2047));
  const StageCost rotated = cost_of("out  root  y, x:16, vector x\n").stages[0];
  EXPECT_GT(rotated.bytes[1], 10 * image_bytes);
  EXPECT_LT(rotated.bytes.back(), 4 * image_bytes) << "the next row finds the lines in L2";
}

TEST_F(CostProbes, StagesInOneLoopLoadOnceWhatBothGather) {
  RDom r(0, 4, "r");
  const Expr gathered = in(clamp(cast<int>(x + other(x, y)), 0, 4095), y + r);
  Func second("second");
  out(x, y) += gathered * r;
  second(x, y) += gathered * (r + 1);
  second.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
  out.set_estimate(x, 0, 4096).set_estimate(y, 0, 2048);
  const std::string loops = "y, x:16, r.x, vector x\n",
                    zeros = "  root\n  .0  y, x:16, vector x\n  .1  ";
  const auto seconds_of = [&](const std::string& shared) {
    const Cost cost =
        Pricing({out, second}).price("out" + zeros + loops + "second" + zeros + shared + loops);
    return compute_seconds(cost);
  };
  const double gathers = 4 * columns * rows * 0.35e-9;
  EXPECT_NEAR(seconds_of("") - seconds_of("shared with out.1/r.x  "), gathers, 0.3 * gathers);
}

TEST_F(CostProbes, TheBinsOfACellAreOneLine) {
  ImageParam values(Int(32), 2, "values");
  values.dim(0).set_estimate(0, 4096);
  values.dim(1).set_estimate(0, 2048);
  Func cells("cells");
  RDom r(0, 4096, 0, 2048, "r");
  cells(z, x, y) = 0.0f;
  cells(clamp(values(r.x, r.y), 0, 12), r.x / 8, r.y / 8) += in(r.x, r.y);
  cells.bound(z, 0, 13).bound(x, 0, 512).bound(y, 0, 256);
  const Cost cost = priced(cells, "cells  root\n  .0  y, x, z\n  .1  r.y, r.x\n");
  const double cell_bytes = 64 * 512 * 256;
  EXPECT_LT(cost.stages[1].bytes.back(), 2 * image_bytes + 3 * cell_bytes);
  EXPECT_LT(cost.stages[1].bytes[2], 9 * cell_bytes) << "eight rows of pixels use a cell";
}

// ---- the report ----

TEST_F(CostProbes, AReportHasALineForEachStage) {
  out(x, y) = in(x, y);
  const Plan plan = parsed("out  root  y, x:16, vector x\n", std::vector<Func>{out});
  const std::string text = to_text(cost_of("out  root  y, x:16, vector x\n"), plan);
  EXPECT_EQ(std::regex_replace(graph::without_numbers(text), std::regex(" +"), " "),
            "stage us compute launch L2 KB L3 KB mem KB bound by\n"
            "out 1.14e+04 249 0 0 0 1.01e+05 memory\n"
            "total 1.14e+04\n"
            "peak KB 0\n");
}

}  // namespace
}  // namespace retrograde::planning
