// Tests the default schedule of adjoints without directives, and its interaction with users' directives.
#include "driver/schedule.h"

#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/packed_operand.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/register_tile.h"
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
#include "support/rules_schedule.h"
#include "support/schedule_log.h"

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
  EXPECT_EQ(loops.back().runs, ForType::Parallel);
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

// The scheduler splits the reduction; the directives that this adds do not count as the user's.
TEST_F(DefaultSchedule, ALossThatIsCutLeavesTheRestOfThePrimalToTheSchedule) {
  Func sum("sum");
  RDom r(0, 80, 0, 80);
  Buffer<float> wide(90, 90);
  Func costly("costly");
  costly(x, y) = exp(wide(x, y)) * sin(wide(x, y)) + cos(wide(x, y));
  sum() = 0.0f;
  sum() += costly(r.x, r.y) * costly(r.x + 1, r.y);
  Derivative d = propagate_adjoints(sum);
  const auto funcs =
      graph::topological_order(driver::schedule_unscheduled({sum.function(), d(wide).function()}));
  const auto found = std::find_if(funcs.begin(), funcs.end(), [&](const graph::FuncPtr& g) {
    return g->name == costly.name();
  });
  ASSERT_NE(found, funcs.end());
  EXPECT_EQ((*found)->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
}

void expect_all_likely(const Expr& condition) {
  if (const auto* both = condition.as<ir::And>()) {
    expect_all_likely(both->a);
    expect_all_likely(both->b);
    return;
  }
  const auto* call = condition.as<ir::Call>();
  EXPECT_TRUE(call && call->is_op(ir::Op::likely)) << print(condition);
}

// f(x, y) += a(x + r, y): the gradient reads the adjoint at x - r, which is inside the adjoint's domain except at a
// border.
TEST_F(DefaultSchedule, ConditionsOfAGatherOverAStencilAreTestedInItsBordersOnly) {
  Buffer<float> wide(640, 4), weights(5);
  Func f("f"), sum("sum");
  RDom taps(0, 5), r(0, 636, 0, 4);
  f(x, y) = 0.0f;
  f(x, y) += wide(x + taps, y) * weights(taps);
  sum() = 0.0f;
  sum() += f(r.x, r.y) * f(r.x, r.y);
  const graph::FuncPtr adjoint = propagate_adjoints(sum)(wide).function();
  ASSERT_TRUE(adjoint->updates.back().predicate.defined());
  expect_all_likely(adjoint->updates.back().predicate);
}

// Half of the iterations of a triangle are outside of it: its loop bounds are tightened instead.
TEST_F(DefaultSchedule, ConditionsOfATriangleAreNoBorders) {
  Buffer<float> wide(640);
  Func f("f"), sum("sum");
  RDom t(0, 640, 0, 640), r(0, 640);
  t.where(t.x <= t.y);
  f(x) = 0.0f;
  f(t.y) += wide(t.x);
  sum() = 0.0f;
  sum() += f(r) * f(r);
  const graph::FuncPtr adjoint = propagate_adjoints(sum)(wide).function();
  const Expr& predicate = adjoint->updates.back().predicate;
  ASSERT_TRUE(predicate.defined());
  std::vector<Expr> conjuncts{predicate};
  while (const auto* both = conjuncts.back().as<ir::And>()) {
    Expr a = both->a, b = both->b;
    conjuncts.back() = b;
    conjuncts.push_back(a);
  }
  for (const Expr& e : conjuncts) {
    const auto* call = e.as<ir::Call>();
    EXPECT_FALSE(uses_variable(e, adjoint->updates.back().rvars[0].var) && call) << print(e);
  }
}

Func parts_of_adjoint(const Derivative& d, const Buffer<float>& of) {
  for (const Func& f : d.funcs()) {
    const std::string name = f.name(), start = of.name() + "_adj";
    if (name.find(start) == 0 && name.find("_parts") != std::string::npos) return f;
  }
  return {};
}

TEST_F(DefaultSchedule, ScattersRunInVectorsThatKeepTheirOrder) {
  Buffer<float> rows(640, 100);
  Buffer<int> place(640, 100);
  Func sum("sum");
  RDom r(0, 640, 0, 100);
  sum() = 0.0f;
  sum() += rows(clamp(place(r.x, r.y), 0, 639), r.y);
  Derivative d = propagate_adjoints(sum);
  const graph::FuncContents gradient = scheduled(d(rows), d(rows));
  ASSERT_EQ(gradient.stage_count(), 2);
  EXPECT_EQ(gradient.stage(1).schedule.dims.front().runs, ForType::Vectorized);
  EXPECT_EQ(gradient.stage(1).schedule.dims.back().runs, ForType::Parallel);
}

TEST_F(DefaultSchedule, ScattersToFewElementsHaveElementsForEachLane) {
  Buffer<float> few(33), many(5000);
  Buffer<int> place(1 << 20);
  Func sum("sum");
  RDom r(0, 1 << 20);
  sum() = 0.0f;
  sum() += few(clamp(place(r), 0, 32)) * many(clamp(place(r), 0, 4999));
  Derivative d = propagate_adjoints(sum);
  EXPECT_EQ(parts_of_adjoint(d, few).dimensions(), 3) << "lane, element, part";
  EXPECT_EQ(parts_of_adjoint(d, many).dimensions(), 2) << "element, part";
}

// Kernels of 3 x 3: vectors along their rows would leave four fifths of the lanes empty.
void expect_sums_in_lanes(int side, Type in) {
  constexpr int channels = 9;
  const Buffer<float> image = gradient::random_image({side + 2, side + 2, channels}, -1, 1, 4);
  const Buffer<float> kernels = gradient::random_image({3, 3, channels, channels}, -1, 1, 5);
  const Buffer<float> seed = gradient::random_image({side, side, channels}, -1, 1, 6);
  Var x("x"), y("y"), c("c");
  Func layer("layer");
  RDom r(0, 3, 0, 3, 0, channels);
  layer(x, y, c) = 0.0f;
  layer(x, y, c) += kernels(r.x, r.y, r.z, c) * image(x + r.x, y + r.y, r.z);
  Derivative d = propagate_adjoints(layer, seed);
  const Func parts = parts_of_adjoint(d, kernels);
  ASSERT_TRUE(parts.defined());
  EXPECT_EQ(parts.dimensions(), 6) << "lane, element and part";
  EXPECT_EQ(parts.type(), in);
  const Buffer<float> gradient = d(kernels).realize({3, 3, channels, channels});
  gradient.for_each_element([&](int i, int j, int from, int to) {
    double sum = 0;
    for (int v = 0; v < side; ++v) {
      for (int u = 0; u < side; ++u)
        sum += static_cast<double>(seed(u, v, to)) * image(u + i, v + j, from);
    }
    EXPECT_NEAR(gradient(i, j, from, to), sum, 1e-5 * (1 + std::abs(sum)));
  });
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

TEST_F(DefaultSchedule, SmallKernelsOfManyChannelsAreSummedInLanes) {
  expect_sums_in_lanes(70, Float(64));
}
// The sums have too few terms to need double, and enough for vector lanes.
TEST_F(DefaultSchedule, SmallKernelsOfSmallPicturesAreSummedInLanes) {
  expect_sums_in_lanes(40, Float(32));
}

// Gradients of a convolution: several channels are summed together, so that each loaded value is used for all of them.
TEST_F(DefaultSchedule, ReductionsKeepATileOfTheirSumsInRegisters) {
  Buffer<float> image(66, 66, 8), kernels(3, 3, 8, 8), seed(64, 64, 8);
  Var c("c");
  Func layer("layer");
  RDom r(0, 3, 0, 3, 0, 8);
  layer(x, y, c) = 0.0f;
  layer(x, y, c) += kernels(r.x, r.y, r.z, c) * image(x + r.x, y + r.y, r.z);
  Derivative d = propagate_adjoints(layer, seed);
  const std::vector<graph::Dim> loops = scheduled(d(image), d(image)).updates.back().schedule.dims;
  ASSERT_GE(loops.size(), 5u);
  EXPECT_EQ(loops[0].runs, ForType::Vectorized);
  EXPECT_EQ(loops[1].runs, ForType::Unrolled);
  EXPECT_EQ(loops[2].runs, ForType::Unrolled);
  EXPECT_TRUE(loops[3].is_reduction);
  EXPECT_EQ(loops.back().runs, ForType::Parallel);
}

// The taps are the inner loops and the channels the outer ones, whatever order the user wrote; a recurrence keeps its
// own order.
TEST_F(DefaultSchedule, SumsOfShiftedRowsAreTakenRowByRow) {
  Buffer<float> image(66, 66, 8), kernels(3, 3, 8, 8), seed(64, 64, 8);
  Var c("c");
  RDom r(0, 8, 0, 3, 0, 3);
  Func layer("layer"), decayed("decayed");
  layer(x, y, c) = 0.0f;
  layer(x, y, c) += kernels(r.y, r.z, r.x, c) * image(x + r.y, y + r.z, r.x);
  decayed(x, y, c) = 0.0f;
  decayed(x, y, c) = 0.5f * decayed(x, y, c) + image(x + r.y, y + r.z, r.x);
  const auto order = [](const Func& f) {
    std::vector<std::string> names;
    for (const graph::ReductionVariable& loop :
         autoschedule::reduction_loops(*f.function(), f.function()->stage(1)))
      names.push_back(loop.var);
    return names;
  };
  EXPECT_EQ(order(layer), (std::vector<std::string>{r.y.name(), r.z.name(), r.x.name()}));
  EXPECT_EQ(order(decayed), (std::vector<std::string>{r.x.name(), r.y.name(), r.z.name()}));
  const auto shifts = [&](size_t d) {
    return autoschedule::shifts_reads(*layer.function(), layer.function()->stage(1), d);
  };
  EXPECT_TRUE(shifts(0));
  EXPECT_TRUE(shifts(1));
  EXPECT_FALSE(shifts(2));
}

// If each row of the right matrix lies at a place of its own in memory, a tile uses it for more elements of the result
// than if rows are contiguous, and reads more vectors of a row at once.
TEST_F(DefaultSchedule, TilesUseWhatComesFromAfarMoreOften) {
  Buffer<float> matrix(64, 64), line(256);
  RDom k(0, 64);
  const auto tile_of = [&](const Func& f) {
    const auto tile = autoschedule::register_tile(*f.function(), f.function()->stage(1), 16, 4, {},
                                                  autoschedule::SizeEstimate({f.function()}));
    return tile.value_or(autoschedule::RegisterTile());
  };
  Func far("far"), near("near");
  far(x, y) += matrix(k, y) * matrix(x, k);
  near(x, y) += matrix(k, y) * line(x + k);
  for (Func f : {far, near}) f.set_estimates({{0, 64}, {0, 64}});
  const autoschedule::RegisterTile from_afar = tile_of(far), side_by_side = tile_of(near);
  ASSERT_EQ(from_afar.sides.size(), 1u);
  ASSERT_EQ(side_by_side.sides.size(), 1u);
  EXPECT_GT(from_afar.vectors * from_afar.sides[0].size,
            side_by_side.vectors * side_by_side.sides[0].size);
  EXPECT_EQ(from_afar.vectors, 4);
}

// A window that starts some cache lines after the one before comes from afar, too.
TEST_F(DefaultSchedule, TilesUseWindowsFromAfarMoreOften) {
  Buffer<float> matrix(64, 64), line(1 << 14);
  RDom k(0, 64);
  const auto sums_of = [&](const Expr& operand) {
    Func f("f");
    f(x, y) += matrix(k, y) * operand;
    f.set_estimates({{0, 64}, {0, 64}});
    const auto tile = autoschedule::register_tile(*f.function(), f.function()->stage(1), 16, 4, {},
                                                  autoschedule::SizeEstimate({f.function()}));
    return tile ? tile->vectors * tile->sides.at(0).size : 0;
  };
  const int64_t side_by_side = sums_of(line(x + 4 * k));
  EXPECT_GT(sums_of(line(x + 64 * k)), side_by_side);
}

// The clamps that keep the last lanes inside of a row are no part of an index, whatever its stride.
TEST_F(DefaultSchedule, StridedIndicesHaveNoClamps) {
  const Expr lane = ir::variable("x"), k = ir::variable("k");
  const Expr found = autoschedule::unclamped(
      min(lane, 55) * 2 + k, [](const Expr& e) { return ir::uses_variable(e, "x"); });
  EXPECT_EQ(ir::print(found), ir::print(lane * 2 + k));
}

// A vector of every second element is picked from two loaded ones, so a tile uses it for more sums.
TEST_F(DefaultSchedule, TilesUseStridedVectorsMoreOften) {
  Buffer<float> signal(1024), taps(8, 64);
  RDom k(0, 8);
  const auto sums_of = [&](int stride) {
    Func f("f");
    f(x, y) += signal(stride * x + k) * taps(k, y);
    f.set_estimates({{0, 256}, {0, 64}});
    const auto tile = autoschedule::register_tile(*f.function(), f.function()->stage(1), 16, 4, {},
                                                  autoschedule::SizeEstimate({f.function()}));
    return tile && tile->sides.size() == 1 ? tile->vectors * tile->sides[0].size : 0;
  };
  EXPECT_GT(sums_of(1), 0);
  EXPECT_GT(sums_of(2), sums_of(1));
}

// Rows a multiple of 32 KiB apart meet in a few sets of a cache. They are packed although there are few signals, whose
// loop alone would not be tasks enough.
TEST_F(DefaultSchedule, RowsThatMeetInACacheArePacked) {
  const auto is_packed = [&](int samples) {
    Buffer<float> signals(samples + 4, 32, 2), taps(5, 32, 64);
    Var z("z");
    Func f("f");
    RDom k(0, 5, 0, 32);
    f(x, y, z) += signals(x + k.x, k.y, z) * taps(k.x, k.y, y);
    f.set_estimates({{0, samples}, {0, 64}, {0, 2}});
    const graph::FuncContents& sums = *f.function();
    const autoschedule::SizeEstimate sizes({f.function()});
    const auto tile = autoschedule::register_tile(sums, sums.stage(1), 16, 4, {}, sizes);
    return tile && autoschedule::packed_operand(sums, sums.stage(1), *tile, 16, sizes);
  };
  EXPECT_FALSE(is_packed(6144));
  EXPECT_TRUE(is_packed(8192));
  EXPECT_TRUE(is_packed(16384));
}

TEST_F(DefaultSchedule, TilesFitTheRegisters) {
  Func product("product");
  RDom k(0, 64);
  Buffer<float> left(64, 64), right(64, 64);
  product(x, y) += left(k, y) * right(x, k);
  const graph::FuncContents& f = *product.function();
  const auto sums = [&](int64_t bytes) {
    planning::Machine machine;
    machine.accumulator_share *=
        static_cast<double>(bytes) / static_cast<double>(machine.accumulator_bytes());
    const auto tile = autoschedule::register_tile(f, f.stage(1), 16, 4, machine);
    int64_t count = tile ? tile->vectors : 0;
    if (tile) {
      for (const autoschedule::RegisterTile::Side& side : tile->sides) count *= side.size;
    }
    return count * 64;
  };
  for (int64_t bytes : {384, 512, 1536}) {
    EXPECT_GT(sums(bytes), bytes / 4) << bytes;
    EXPECT_LE(sums(bytes), bytes);
  }
  EXPECT_EQ(sums(64), 0) << "no tile of one vector";
}

// Returns the log of the schedule for all of `output`, with names without numbers, and checks that its values equal the
// unscheduled ones.
ScheduleLog log_of(const Func& output, const std::vector<int32_t>& sizes,
                   const Target& target = get_host_target()) {
  const graph::GraphCopy copy = graph::copy_graph({output.function()});
  Pipeline plain(Func(copy.outputs[0])), pipeline(output);
  plain.unscheduled();
  const Buffer<float> expected = plain.realize(sizes)[0];
  for (size_t d = 0; d < sizes.size(); ++d)
    Func(output).set_estimate(output.args()[d], 0, sizes[d]);
  schedule_by_rules(pipeline, target);
  const Buffer<float> found = pipeline.realize(sizes)[0];
  found.for_each_element([&](const int* at) {
    EXPECT_NEAR(found(at), expected(at), 1e-5 * (1 + std::abs(expected(at))));
  });
  return without_numbers(pipeline.schedule_log());
}

// The log of a layer that mixes 32 channels of an image of this width: a tile reads a piece of each plane, again for
// every channel of the result. Inlined producers are computed once for each element of the packed copy.
ScheduleLog log_of_mixing(int width, int channels) {
  const Buffer<float> image = gradient::random_image({width, 12, 32}, -1, 1, 1);
  const Buffer<float> weights = gradient::random_image({32, channels}, -1, 1, 2);
  Var x("x"), y("y"), c("c");
  RDom k(0, 32);
  Func inner("inner"), mixed("mixed");
  inner(x, y, c) = max(image(x, y, c), 0.0f);
  mixed(x, y, c) += weights(k, c) * inner(x, y, k);
  return log_of(mixed, {width, 12, channels});
}

TEST_F(DefaultSchedule, WhatATileReadsFromManyPlanesIsPacked) {
  const ScheduleLog log = log_of_mixing(125, 32);
  EXPECT_TRUE(has_entry(log, "inner.in(inner_in_mixed, mixed)")) << log.to_text();
}

// An initialisation pass of its own would write all of the sums, and the tiles would read them again.
TEST_F(DefaultSchedule, SumsStartInTheirTiles) {
  const ScheduleLog log = log_of_mixing(125, 32);
  const bool starts_in_tiles = any_directive<graph::ComputeWith>(
      log, [](const ScheduleLog::Entry& entry, const graph::ComputeWith& with) {
        return entry.func == "mixed" && entry.stage == 1 && with.level.func == "mixed";
      });
  EXPECT_TRUE(starts_in_tiles) << log.to_text();
}

// Each row of the result reads three rows of the image, two of which the next row reads too.
TEST_F(DefaultSchedule, RowsOfAStencilShareWhatIsPacked) {
  const Buffer<float> image = gradient::random_image({128, 130, 32}, -1, 1, 1);
  const Buffer<float> weights = gradient::random_image({3, 3, 32, 32}, -1, 1, 2);
  Var x("x"), y("y"), c("c");
  RDom r(0, 3, 0, 3, 0, 32);
  Func inner("inner"), filtered("filtered");
  inner(x, y, c) = max(image(x, y, c), 0.0f);
  filtered(x, y, c) += weights(r.x, r.y, r.z, c) * inner(x + r.x, y + r.y, r.z);
  const ScheduleLog log = log_of(filtered, {125, 128, 32});
  EXPECT_TRUE(has_entry(log, "inner.in(inner_in_filtered, filtered)")) << log.to_text();
  const bool has_blocks_of_rows = any_directive<graph::SplitLoop>(
      log, [](const ScheduleLog::Entry& entry, const graph::SplitLoop& split) {
        return entry.func == "filtered" && entry.stage == 1 && split.inner == "yi";
      });
  EXPECT_TRUE(has_blocks_of_rows) << log.to_text();
}

// Lanes across the rows of an image read each element from a cache line of its own, so the image is packed transposed.
TEST_F(DefaultSchedule, WhatLanesReadAcrossRowsIsCopiedTurned) {
  for (const auto& [rows, columns] : {std::pair{64, 256}, std::pair{60, 299}}) {
    const Buffer<float> keys = gradient::random_image({rows, columns}, -1, 1, 1);
    const Buffer<float> queries = gradient::random_image({rows, columns}, -1, 1, 2);
    Func product("product");
    RDom k(0, rows);
    product(x, y) += keys(k, x) * queries(k, y);
    const ScheduleLog log = log_of(product, {columns, columns});
    EXPECT_TRUE(has_entry(log, "product.copy_input(b_in_product, b)")) << log.to_text();
    EXPECT_TRUE(has_entry(log, "b_in_product.reorder_storage(_1, _0)")) << log.to_text();
  }
}

// Overlapping windows of a signal under filters, which are so few that tiles of them would be two parallel chunks.
Func windows_under_filters(const Buffer<float>& signal, const Buffer<float>& filters, int hop) {
  Var k("k"), t("t");
  Func windows("windows");
  RDom r(0, filters.width());
  windows(k, t) += signal(hop * t + r) * filters(r, k);
  return windows;
}
Buffer<float> random_signal(int samples, int seed) {
  return gradient::random_image({samples}, -1, 1, seed);
}

// All of the filters are transposed once. Lanes along each filter would add up one window of it at a time.
TEST_F(DefaultSchedule, WhatFewTilesReadAcrossRowsIsCopiedTurnedAtOnce) {
  for (const int length : {96, 121}) {
    const Buffer<float> filters = gradient::random_image({length, 40}, -0.3f, 0.3f, 2);
    const Func windows = windows_under_filters(random_signal(2000, 1), filters, 8);
    const ScheduleLog log = log_of(windows, {40, (2000 - length) / 8});
    EXPECT_TRUE(has_entry(log, "windows.copy_input(b_in_windows, b)")) << log.to_text();
    EXPECT_TRUE(has_entry(log, "b_in_windows.reorder_storage(_1, _0)")) << log.to_text();
    EXPECT_TRUE(has_entry(log, "b_in_windows.compute_at(root)")) << log.to_text();
  }
}

// Tiles of many terms are added in blocks, so that they are about as exact as sums along rows. Equal terms are the
// worst case: one after the other, their sum would be wrong by 5e-5 of itself.
TEST_F(DefaultSchedule, TilesOfManyTermsAreAddedInBlocks) {
  constexpr int length = 4000, frames = 80, kinds = 32;
  Buffer<float> signal(8 * (frames - 1) + length), filters(length, kinds);
  signal.fill(0.1f);
  filters.fill(0.3f);
  Func windows = windows_under_filters(signal, filters, 8);
  windows.set_estimates({{0, kinds}, {0, frames}});
  Pipeline pipeline(windows);
  schedule_by_rules(pipeline);
  const ScheduleLog log = without_numbers(pipeline.schedule_log());
  EXPECT_TRUE(any_directive<graph::CopyInput>(log)) << log.to_text();
  EXPECT_TRUE(any_directive<graph::FactorOut>(log)) << log.to_text();
  const Buffer<float> found = windows.realize({kinds, frames});
  const double expected = double(0.1f) * double(0.3f) * length;
  found.for_each_element(
      [&](int k, int t) { EXPECT_NEAR(found(k, t), expected, 3e-6 * expected); });
}

TEST_F(DefaultSchedule, FewUsesAreNotWorthACopyOfAll) {
  const Buffer<float> filters = gradient::random_image({96, 40}, -0.3f, 0.3f, 2);
  const ScheduleLog log =
      log_of(windows_under_filters(random_signal(200, 1), filters, 8), {40, 10});
  EXPECT_FALSE(any_directive<graph::CopyInput>(log)) << log.to_text();
}

// A panel of all rows is too large for the inner caches, so one block of rows is packed at a time.
TEST_F(DefaultSchedule, PanelsOfLongProductsArePackedBlockByBlock) {
  constexpr int rows = 40, inner = 1100, columns = 512;
  const Buffer<float> left = gradient::random_image({inner, rows}, -1, 1, 1);
  const Buffer<float> right = gradient::random_image({columns, inner}, -1, 1, 2);
  Func product("product");
  RDom k(0, inner);
  product(x, y) += left(k, y) * right(x, k);
  const ScheduleLog log = log_of(product, {columns, rows});
  EXPECT_TRUE(has_entry(log, "product.copy_input(b_in_product, b)")) << log.to_text();
  EXPECT_TRUE(has_entry(log, "b_in_product.compute_at(loop(product, blocks))")) << log.to_text();
}

// Whether a sum is split into chunks that its tiles share.
bool has_chunks(const ScheduleLog& log) {
  return any_directive<graph::SplitLoop>(
      log, [](const auto&, const graph::SplitLoop& split) { return split.outer == "chunks"; });
}

// Each tile of the weights' gradient would read the whole image, so tiles share chunks of rows.
TEST_F(DefaultSchedule, TilesOfLongSumsShareChunksOfLargeImages) {
  constexpr int channels = 64;
  const auto log_for = [&](int width, int height) {
    const Buffer<float> image = gradient::random_image({width, height, channels}, -1, 1, 1);
    const Buffer<float> weights = gradient::random_image({channels, channels}, -1, 1, 2);
    const Buffer<float> seed = gradient::random_image({width, height, channels}, -1, 1, 3);
    Var x("x"), y("y"), c("c");
    RDom k(0, channels);
    Func mixed("mixed");
    mixed(x, y, c) += weights(k, c) * image(x, y, k);
    return log_of(propagate_adjoints(mixed, seed)(weights), {channels, channels});
  };
  EXPECT_TRUE(has_chunks(log_for(128, 48)));
  EXPECT_FALSE(has_chunks(log_for(32, 32))) << "caches hold it";
}

// Tiles of a gradient by filters would each read all windows of the signal, and all adjoints, from beyond the near caches.
TEST_F(DefaultSchedule, TilesOfWindowsShareChunksOfSignals) {
  const auto log_for = [](int frames) {
    constexpr int length = 256, kinds = 32, hop = 64;
    const Buffer<float> filters = gradient::random_image({length, kinds}, -0.3f, 0.3f, 2);
    const Buffer<float> seed = gradient::random_image({kinds, frames}, -1, 1, 3);
    const Func windows =
        windows_under_filters(random_signal(hop * (frames - 1) + length, 1), filters, hop);
    return log_of(propagate_adjoints(windows, seed)(filters), {length, kinds});
  };
  EXPECT_TRUE(has_chunks(log_for(4000)));
  EXPECT_FALSE(has_chunks(log_for(1000))) << "caches hold it";
}

// All blocks of a chunk read the same few rows repeatedly. The packed copy is padded with zeros, so that these reads
// need no conditions at the row ends. The seed is read only inside of its box, so its rows need no packing.
TEST_F(DefaultSchedule, BlocksOfAChunkReadRowsCopiedThroughZerosAround) {
  constexpr int channels = 16;
  const auto log_for = [&](bool has_zeros, const char* target) {
    const Buffer<float> image = gradient::random_image({130, 194, channels}, -1, 1, 1);
    const Buffer<float> weights = gradient::random_image({3, 3, channels, channels}, -1, 1, 2);
    const Buffer<float> seed = gradient::random_image({128, 192, channels}, -1, 1, 3);
    Var x("x"), y("y"), c("c");
    RDom r(0, 3, 0, 3, 0, channels);
    Func around = BoundaryConditions::constant_exterior(image, 0.0f), sums("sums");
    const int first = has_zeros ? -1 : 0;
    const Expr at_x = x + r.x + first, at_y = y + r.y + first;
    sums(x, y, c) +=
        weights(r.x, r.y, r.z, c) * (has_zeros ? around(at_x, at_y, r.z) : image(at_x, at_y, r.z));
    const Func gradient = propagate_adjoints(sums, seed)(weights);
    return log_of(gradient, {3, 3, channels, channels}, Target(target));
  };
  const auto packed = [](const ScheduleLog& log) {
    std::vector<std::string> funcs;
    for (const ScheduleLog::Entry& entry : log.entries) {
      if (std::holds_alternative<graph::Wrap>(entry.directive)) funcs.push_back(entry.func);
    }
    return funcs;
  };
  const ScheduleLog with_zeros = log_for(true, "x86-64-linux-avx2-fma"),
                    without = log_for(false, "x86-64-linux-avx2-fma"),
                    wide = log_for(true, "x86-64-linux-avx2-fma-avx512-avx512_skylake");
  EXPECT_TRUE(has_chunks(without));
  EXPECT_EQ(packed(without), std::vector<std::string>());
  for (const ScheduleLog& log : {with_zeros, wide})
    EXPECT_EQ(packed(log), std::vector<std::string>{"constant_exterior"});
}

// Few tiles use the values that one tile has read, so their rows are still in the cache.
TEST_F(DefaultSchedule, WhatFewTilesUseIsNotPacked) {
  EXPECT_FALSE(any_directive<graph::Wrap>(log_of_mixing(128, 8)));
}

// Three planes are too few parallel chunks, so their rows are chunks, too.
TEST_F(DefaultSchedule, FewPlanesAreCutIntoTasksOfRows) {
  const Buffer<float> image = gradient::random_image({40, 30, 3}, -1, 1, 1);
  const Buffer<float> seed = gradient::random_image({40, 30, 3}, -1, 1, 2);
  Var c("c");
  Func square("square");
  square(x, y, c) = image(x, y, c) * image(x, y, c);
  Func gradient = propagate_adjoints(square, seed)(image);
  const std::vector<graph::Dim> loops = scheduled(gradient, gradient).pure->schedule.dims;
  ASSERT_GE(loops.size(), 3u);
  EXPECT_EQ(loops[loops.size() - 1].runs, ForType::Parallel);
  EXPECT_EQ(loops[loops.size() - 2].runs, ForType::Parallel);
}

// A sum over three long planes is split over the rows, which are many, instead of the planes.
TEST_F(DefaultSchedule, PartsOfASumAreManyWhereItsLastLoopIsShort) {
  const Buffer<float> image = gradient::random_image({64, 320, 3}, 0.5f, 1, 1);
  Buffer<float> gamma(1);
  gamma.fill(0.7f);
  Var c("c");
  RDom r(0, 64, 0, 320, 0, 3);
  Func corrected("corrected"), sum("sum");
  corrected(x, y, c) = pow(image(x, y, c), gamma(Expr(0)));
  sum() += corrected(r.x, r.y, r.z);
  const Derivative d = propagate_adjoints(sum);
  const Func by_gamma = d(gamma);
  bool has_parts = false;
  for (const graph::FuncPtr& f : graph::topological_order({by_gamma.function()})) {
    if (!f->made || !f->made->has_parts) continue;
    has_parts = true;
    const std::string last = ir::print(f->updates[0].rvars.back().extent);
    EXPECT_EQ(last, "3") << "all planes belong to each part";
  }
  EXPECT_TRUE(has_parts);
}

// Both gradients by the coordinates at which an image is read sum over the same four corners.
TEST_F(DefaultSchedule, SumsThatLookTheSamePlacesUpShareTheirLoops) {
  const int size = 40, channels = 6;
  const Buffer<float> image = gradient::random_image({size, size, channels}, -1, 1, 1);
  const Buffer<float> flow = gradient::random_image({size, size, 2}, -5, 5, 2);
  const Buffer<float> seed = gradient::random_image({size, size, channels}, -1, 1, 3);
  const Func warped = gradient::bilinear_warp(image, flow);
  const Derivative d = propagate_adjoints(warped, seed);
  Func by_flow = d(flow);
  const Buffer<float> apart = [&] {
    const graph::GraphCopy copy = graph::copy_graph({by_flow.function()});
    Pipeline pipeline(Func(copy.outputs[0]));
    pipeline.unscheduled();
    return Buffer<float>(pipeline.realize({size, size, 2})[0]);
  }();
  const Buffer<float> together = by_flow.realize({size, size, 2});
  together.for_each_element([&](int a, int b, int k) {
    EXPECT_NEAR(together(a, b, k), apart(a, b, k), 1e-5 * (1 + std::abs(apart(a, b, k))));
  });
  schedule_by_rules(Pipeline(by_flow));
  const ScheduleLog log = without_numbers(Pipeline(by_flow).schedule_log());
  const bool shares_loops = any_directive<graph::ComputeWith>(
      log, [](const ScheduleLog::Entry& entry, const graph::ComputeWith& with) {
        return entry.func == "u_adj" && entry.stage == 1 && with.level.func == "v_adj";
      });
  EXPECT_TRUE(shares_loops) << log.to_text();
}

// A kernel of 11 x 11: its tiles have no remainder on any side, and sums to few elements use vector lanes and parallel
// chunks.
TEST_F(DefaultSchedule, TilesFitTheSizesThatAreKnown) {
  Buffer<float> left(11, 64), right(64, 64);
  Func product("product");
  RDom k(0, 64);
  product(x, y) += left(y, k) * right(x, k);
  product.set_estimates({{0, 64}, {0, 11}});
  const auto tile =
      autoschedule::register_tile(*product.function(), product.function()->stage(1), 16, 4, {},
                                  autoschedule::SizeEstimate({product.function()}));
  ASSERT_TRUE(tile.has_value());
  ASSERT_EQ(tile->sides.size(), 1u);
  EXPECT_EQ(tile->sides[0].size, 11) << "no rest";
}

// A convolution of several images.
autoschedule::RegisterTile tile_of_layer(int width) {
  Buffer<float> weights(3, 3, 16, 16), images(width + 2, 26, 16, 4);
  Var x("x"), y("y"), c("c"), n("n");
  Func layer("layer");
  RDom r(0, 3, 0, 3, 0, 16);
  layer(x, y, c, n) += weights(r.x, r.y, r.z, c) * images(x + r.x, y + r.y, r.z, n);
  layer.set_estimates({{0, width}, {0, 24}, {0, 16}, {0, 4}});
  const auto tile =
      autoschedule::register_tile(*layer.function(), layer.function()->stage(1), 16, 4, {},
                                  autoschedule::SizeEstimate({layer.function()}));
  return tile.value_or(autoschedule::RegisterTile());
}

// 17 vectors do not divide into pairs. A tile computes one vector more instead of reading rows of two images at once.
TEST_F(DefaultSchedule, TilesReadRowsOfOneImage) {
  for (int width : {256, 272, 240}) {
    const autoschedule::RegisterTile tile = tile_of_layer(width);
    ASSERT_FALSE(tile.sides.empty()) << width;
    for (const autoschedule::RegisterTile::Side& side : tile.sides)
      EXPECT_LT(side.dimension, 3u) << width;
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
  const autoschedule::SizeEstimate sizes({second.function()});
  EXPECT_EQ(sizes.extent(*second.function(), 0), 40);
  EXPECT_EQ(sizes.extent(*second.function(), 1), std::nullopt);
  EXPECT_EQ(sizes.extent(*first.function(), 0), 42);
  EXPECT_EQ(sizes.extent(*edge.function(), 0), 83);
  EXPECT_EQ(sizes.extent(*edge.function(), 1), std::nullopt);
  second.set_estimate(y, 0, 30);
  EXPECT_EQ(autoschedule::SizeEstimate({second.function()}).extent(*edge.function(), 1), 30);
}

TEST_F(DefaultSchedule, SizesFollowFromThoseOfTheBuffersOfOutputs) {
  const Buffer<float> image(100, 80);
  Func edge("edge"), sums("sums");
  edge(x, y) = image(clamp(x, 0, 99), clamp(y, 0, 79));
  RDom r(-1, 3);
  sums(x, y) += edge(x + r, y);
  sums.output_buffer().dim(0).set_bounds(2, 40);
  edge.output_buffer().dim(1).set_bounds(0, 80);
  const autoschedule::SizeEstimate bound({sums.function()});
  EXPECT_EQ(bound.extent(*sums.function(), 0), 40);
  EXPECT_EQ(bound.extent(*edge.function(), 0), 42);
  EXPECT_EQ(bound.extent(*edge.function(), 1), std::nullopt) << "edge fills no buffer here";
  sums.output_buffer().dim(1).set_estimate(0, 30);
  EXPECT_EQ(autoschedule::SizeEstimate({sums.function()}).extent(*edge.function(), 1), 30);
  sums.set_estimate(y, 0, 20);
  EXPECT_EQ(autoschedule::SizeEstimate({sums.function()}).extent(*edge.function(), 1), 20)
      << "what the Func says comes first";
}

TEST_F(DefaultSchedule, SumsToAFewElementsAreCut) {
  Buffer<float> image = gradient::random_image({300, 200, 5}, 0, 1, 3);
  Func energy("energy");
  RDom r(0, 300, 0, 200);
  energy(x) = 0.0f;
  energy(x) += image(r.x, r.y, x) * image(r.x, r.y, x);
  energy.set_estimate(x, 0, 5);
  const Pipeline pipeline(energy);
  schedule_by_rules(pipeline);
  EXPECT_TRUE(any_directive<graph::FactorOut>(pipeline.schedule_log()));
  const Buffer<float> sums = energy.realize({5});
  for (int c = 0; c < 5; ++c) {
    double sum = 0;
    image.for_each_element([&](int i, int j, int k) {
      if (k == c) sum += static_cast<double>(image(i, j, k)) * image(i, j, k);
    });
    EXPECT_NEAR(sums(c), sum, 5e-6 * sum);
  }
}

// One chain of additions in float32 would be off by 1e-3 here.
TEST_F(DefaultSchedule, LossesAreSummedInLanesAndRows) {
  for (bool is_flat : {false, true}) {
    const int width = is_flat ? 3'000'001 : 3001, height = is_flat ? 1 : 1001;
    Buffer<float> image(width, height);
    image.for_each_element(
        [&](int i, int j) { image(i, j) = static_cast<float>((i * 7 + j * 13) % 101) * 0.01f; });
    Func sum("sum");
    RDom flat(0, width), r(0, width, 0, height);
    sum() = 0.5f;
    if (is_flat)
      sum() += image(flat, 0) * image(flat, 0);
    else
      sum() += image(r.x, r.y) * image(r.x, r.y);
    double expected = 0.5;
    image.for_each_element(
        [&](int i, int j) { expected += static_cast<double>(image(i, j)) * image(i, j); });
    Derivative d = propagate_adjoints(sum);
    Buffer<float> gradient(width, height);
    Buffer<float> loss = Buffer<float>::make_scalar();
    Pipeline({sum, d(image)}).realize({loss, gradient});
    EXPECT_NEAR(loss(), expected, 1e-6 * expected) << is_flat;
    EXPECT_EQ(gradient(5, 0), 2 * image(5, 0));
  }
}

bool has_select(const Expr& e) {
  return ir::any_node(e, [](const ir::Select&) { return true; });
}

// Upsampling by two with clamped borders: the first element is read four times, the others twice, all at indices of one
// sum.
TEST_F(DefaultSchedule, BordersReadMoreOftenLeaveThePlacesOfTheInteriorAlone) {
  const Buffer<float> small = gradient::random_image({64, 5}, -1, 1, 4);
  const Buffer<float> seed = gradient::random_image({128, 5}, -1, 1, 6);
  Func inside("inside"), large("large");
  inside(x, y) = small(x, y);
  large(x, y) = inside(clamp(x / 2 - 1, 0, 63), y);
  Func adjoint = propagate_adjoints(large, seed)(inside);
  for (const graph::Definition& update : adjoint.function()->updates)
    for (const Expr& value : update.values) EXPECT_FALSE(has_select(value)) << print(value);
  const Buffer<float> gradient = adjoint.realize({64, 5});
  for (int j = 0; j < 5; ++j) {
    EXPECT_NEAR(gradient(0, j), seed(0, j) + seed(1, j) + seed(2, j) + seed(3, j), 1e-5);
    for (int i = 1; i < 63; ++i)
      EXPECT_NEAR(gradient(i, j), seed(2 * i + 2, j) + seed(2 * i + 3, j), 1e-5);
    EXPECT_EQ(gradient(63, j), 0.0f);
  }
}

// The number of reads of `read` in the last stage of `reader`.
double reads(const Func& reader, const Func& read) {
  const graph::FuncContents& f = *reader.function();
  const graph::Definition& stage = f.stage(f.stage_count() - 1);
  double total = 0;
  walk(stage, [&](const ir::Call& call) {
    if (call.symbol.raw() == read.function().get())
      total += autoschedule::reads_an_element(call, f, stage);
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

// Each of six sums over the pixels takes the adjoint of a position, which gathers from the image four times.
TEST_F(DefaultSchedule, WhatManyCutSumsReadIsStored) {
  ImageParam image(Float(32), 2, "image");
  std::vector<ImageParam> motion;  // one for each number, so that each has a sum of its own
  for (int k = 0; k < 6; ++k) motion.emplace_back(Float(32), 1, "motion_" + std::to_string(k));
  Func u("u"), v("v"), seen("seen"), error("error");
  const Expr across = cast<float>(x) / 512.0f, down = cast<float>(y) / 512.0f;
  u(x, y) = 512.0f * (motion[0](0) * across + motion[1](0) * down + motion[2](0));
  v(x, y) = 512.0f * (motion[3](0) * across + motion[4](0) * down + motion[5](0));
  const Expr i = clamp(cast<int>(floor(u(x, y))), 0, 510),
             j = clamp(cast<int>(floor(v(x, y))), 0, 510);
  const Expr s = u(x, y) - cast<float>(i), t = v(x, y) - cast<float>(j);
  seen(x, y) =
      lerp(lerp(image(i, j), image(i + 1, j), s), lerp(image(i, j + 1), image(i + 1, j + 1), s), t);
  const RDom r(0, 512, 0, 512);
  error() = 0.0f;
  error() += seen(r.x, r.y) * seen(r.x, r.y);
  image.dim(0).set_bounds(0, 512), image.dim(1).set_bounds(0, 512);
  for (ImageParam& m : motion) m.dim(0).set_bounds(0, 1);
  AdjointOptions options;
  options.wrt.assign(motion.begin(), motion.end());
  const Derivative d = propagate_adjoints(error, options);
  std::vector<graph::FuncPtr> gradients;
  for (const ImageParam& m : motion) gradients.push_back(d(m).function());
  for (const graph::FuncPtr& f :
       graph::topological_order(driver::schedule_unscheduled(gradients))) {
    const bool is_position = f->name == d.adjoint(u).name() || f->name == d.adjoint(v).name();
    if (is_position) {
      EXPECT_EQ(f->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
    }
  }
}

TEST_F(DefaultSchedule, StoresADivisionThatIsReadOften) {
  Func inverse("inverse"), shifted("shifted");
  inverse(x, y) = 1.0f / (a(x, y) + 2.0f);
  shifted(x, y) = a(x, y) + 2.0f;
  for (const Func& f : {inverse, shifted}) {
    Func around("around"), total("total");
    around(x, y) = f(x, y) + f(x + 1, y) + f(x + 2, y) + f(x, y + 1) + f(x, y + 2);
    RDom r(0, 30, 0, 30);
    total() = 0.0f;
    total() += around(r.x, r.y) * around(r.x, r.y) * around(r.x, r.y);
    EXPECT_EQ(is_stored(propagate_adjoints(total)(a), f), f.name() == inverse.name());
  }
}

TEST_F(DefaultSchedule, TilesWhatItReadsAcross) {
  Buffer<float> b(32, 32);
  Func sum("sum");
  RDom r(0, 32, 0, 32);
  sum() = 0.0f;
  sum() += a(r.y, r.x) * b(r.x, r.y);
  Derivative d = propagate_adjoints(sum);
  const std::vector<graph::Dim> loops = scheduled(d(a), d(a)).pure->schedule.dims;
  ASSERT_EQ(loops.size(), 4u);
  EXPECT_EQ(loops[0].runs, ForType::Vectorized);
  EXPECT_EQ(loops[3].runs, ForType::Parallel);
}

// The adjoint of `planes` has updates of one plane each, which have no loop over z.
TEST_F(DefaultSchedule, TilesAPlaneThatIsReadAcross) {
  Buffer<float> planes(32, 32, 32);
  Func sum("sum");
  RDom r(0, 32, 0, 32);
  sum() = 0.0f;
  sum() += planes(r.y, r.x, 0) * planes(r.y, r.x, 20) * a(r.x, r.y);
  Func gradient = propagate_adjoints(sum)(planes);
  const graph::FuncContents adjoint = scheduled(gradient, gradient);
  ASSERT_EQ(adjoint.stage_count(), 3);
  ASSERT_EQ(adjoint.stage(1).schedule.dims.size(), 4u);
  EXPECT_EQ(adjoint.stage(1).schedule.dims[3].runs, ForType::Parallel);
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
