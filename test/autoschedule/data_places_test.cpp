// The default schedule of adjoints of data-dependent reads: slices of large scatters, sums of privatised copies, planes
// that share their indices.
#include <gtest/gtest.h>

#include "autodiff/derivative.h"
#include "driver/schedule.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "graph/directives/schedule_log.h"
#include "support/schedule_log.h"

namespace retrograde {
namespace {

// An image with several channels, interpolated at positions that a flow gives.
struct Warp {
  Warp(int size, int channels)
      : size(size),
        channels(channels),
        image(gradient::random_image({size, size, channels}, -1, 1, 1)),
        flow(gradient::random_image({size, size, 2}, -5, 5, 2)),
        seed(gradient::random_image({size, size, channels}, -1, 1, 3)) {
    Var x("x"), y("y"), c("c");
    u(x, y) = clamp(x + flow(x, y, 0), 0.0f, size - 1.0f);
    v(x, y) = clamp(y + flow(x, y, 1), 0.0f, size - 1.0f);
    const Expr i = clamp(cast<int>(u(x, y)), 0, size - 2);
    const Expr j = clamp(cast<int>(v(x, y)), 0, size - 2);
    warped(x, y, c) =
        lerp(lerp(image(i, j, c), image(i + 1, j, c), u(x, y) - i),
             lerp(image(i, j + 1, c), image(i + 1, j + 1, c), u(x, y) - i), v(x, y) - j);
  }
  // The gradients by the image and by the flow, and the warped image.
  std::vector<Func> outputs() {
    const Derivative d = propagate_adjoints(warped, seed);
    std::vector<Func> funcs{d(image), d(flow), warped};
    const std::vector<std::vector<int>> sizes{
        {size, size, channels}, {size, size, 2}, {size, size, channels}};
    for (size_t k = 0; k < funcs.size(); ++k) {
      Region all;
      for (const int extent : sizes[k]) all.push_back({0, extent});
      funcs[k].set_estimates(all);
    }
    return funcs;
  }
  std::vector<Buffer<float>> run(Pipeline pipeline, int threads) const {
    std::vector<Buffer<float>> results{Buffer<float>(size, size, channels),
                                       Buffer<float>(size, size, 2),
                                       Buffer<float>(size, size, channels)};
    pipeline.jit_handlers().thread_limit = threads;
    pipeline.realize(Realization({results[0], results[1], results[2]}));
    return results;
  }

  int size, channels;
  Buffer<float> image, flow, seed;
  Func u{"u"}, v{"v"}, warped{"warped"};
};

// The log of the schedule, with names without numbers.
ScheduleLog log_of(const std::vector<Func>& outputs) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  return without_numbers(graph::schedule_log(driver::schedule_unscheduled(funcs)));
}

// The Funcs that are computed in a loop of another.
std::vector<std::string> computed_in_loops(const ScheduleLog& log) {
  std::vector<std::string> funcs;
  for (const ScheduleLog::Entry& entry : log.entries) {
    const auto* compute = std::get_if<graph::ComputeAt>(&entry.directive);
    if (compute && compute->level.kind == graph::LoopLevel::Kind::At)
      funcs.push_back(text(entry.func, " in ", compute->level.func));
  }
  return funcs;
}

// A copy in which every sum is at root, in serial loops.
Pipeline in_plain_loops(const std::vector<Func>& outputs) {
  std::vector<graph::FuncPtr> funcs;
  for (const Func& f : outputs) funcs.push_back(f.function());
  const std::vector<graph::FuncPtr> copies = graph::copy_graph(funcs).outputs;
  for (const graph::FuncPtr& f : graph::topological_order(copies)) {
    if (!f->is_pure()) Func(f).compute_root();
  }
  Pipeline pipeline(std::vector<Func>(copies.begin(), copies.end()));
  pipeline.unscheduled();
  return pipeline;
}

void expect_close(const Buffer<float>& found, const Buffer<float>& expected) {
  for (size_t i = 0; i < expected.number_of_elements(); ++i) {
    const float e = expected.data()[i];
    ASSERT_NEAR(found.data()[i], e, 1e-5 * (1 + std::abs(e))) << "element " << i;
  }
}

void expect_same_values(Warp& warp) {
  const std::vector<Func> outputs = warp.outputs();
  const auto expected = warp.run(in_plain_loops(outputs), 1);
  const auto one = warp.run(Pipeline(outputs), 1);
  const auto many = warp.run(Pipeline(outputs), 3);
  for (size_t k = 0; k < outputs.size(); ++k) {
    SCOPED_TRACE(k);
    expect_close(one[k], expected[k]);
    for (size_t i = 0; i < one[k].number_of_elements(); ++i)
      ASSERT_EQ(one[k].data()[i], many[k].data()[i]) << "element " << i;
  }
}

// In double, this scatter takes 18 MiB: too much for privatised copies.
TEST(ScatterSlices, AreComputedInTheLoopsOfTheirOnlyReader) {
  Warp warp(136, 128);
  const std::vector<Func> outputs = warp.outputs();
  EXPECT_EQ(computed_in_loops(log_of(outputs)), std::vector<std::string>{"b_adj_sum in b_adj"});
  expect_same_values(warp);
}

// The number of channels is not a multiple of the slice.
TEST(ScatterSlices, MayBeIncomplete) {
  Warp warp(139, 127);
  const std::vector<Func> outputs = warp.outputs();
  EXPECT_EQ(computed_in_loops(log_of(outputs)), std::vector<std::string>{"b_adj_sum in b_adj"});
  expect_same_values(warp);
}

TEST(ScatterSlices, AreNotOfWhatFitsACache) {
  Warp warp(40, 24);
  EXPECT_EQ(computed_in_loops(log_of(warp.outputs())), std::vector<std::string>());
}

TEST(ScatterSlices, AreNotWhereSeveralReadThem) {
  Warp warp(136, 128);
  std::vector<Func> outputs = warp.outputs();
  Func sum = Func(graph::direct_callees(*outputs[0].function())[0]);
  ASSERT_NE(sum.name().find("_sum"), std::string::npos);
  Var x("x"), y("y"), c("c");
  Func other("other");
  other(x, y, c) = sum(x, y, c) * 2.0f;
  other.set_estimates({{0, 136}, {0, 136}, {0, 128}});
  outputs.push_back(other);
  EXPECT_EQ(computed_in_loops(log_of(outputs)), std::vector<std::string>());
}

TEST(LookUps, OfSeveralPlanesShareTheirPlaces) {
  for (const int channels : {3, 4, 9}) {
    SCOPED_TRACE(channels);
    Warp warp(37, channels);
    const ScheduleLog log = log_of(warp.outputs());
    const std::string planes = std::to_string(channels <= 4 ? channels : 2);
    EXPECT_TRUE(has_entry(log, "warped.split(c, c, ci, " + planes + ", GuardWithIf)"))
        << log.to_text();
    EXPECT_TRUE(has_entry(log, "warped.run(ci, Unrolled)")) << log.to_text();
    expect_same_values(warp);
  }
}

// Planes are outside of a block of rows, and values that both coordinates read are loaded once.
TEST(LookUps, ThatAreSummedRunPlaneAfterPlane) {
  Warp warp(67, 21);
  const ScheduleLog log = log_of(warp.outputs());
  EXPECT_TRUE(has_entry(log, "v_adj.update(0).split(y, y, yi, 8, GuardWithIf)")) << log.to_text();
  EXPECT_TRUE(has_entry(log, "u_adj.update(0).compute_with(loop(v_adj, x, 1))")) << log.to_text();
  expect_same_values(warp);
}

// A Func that reads a single element has no use for this loop order.
TEST(LookUps, OfATableKeepTheirLoops) {
  const Buffer<float> table = gradient::random_image({256, 3}, 0, 1, 1);
  const Buffer<float> seed = gradient::random_image({40, 30, 3}, -1, 1, 3);
  const Buffer<float> at = gradient::random_image({40, 30}, 0, 255, 2);
  Var x("x"), y("y"), c("c");
  Func mapped("mapped");
  mapped(x, y, c) = table(clamp(cast<int>(at(x, y)), 0, 255), c);
  const Derivative d = propagate_adjoints(mapped, seed);
  const ScheduleLog log = log_of({d(table), mapped});
  const bool unrolls_planes =
      any_directive<graph::RunLoop>(log, [](const auto&, const graph::RunLoop& run) {
        return run.loop == "ci" && run.kind == ForType::Unrolled;
      });
  EXPECT_FALSE(unrolls_planes) << log.to_text();
}

// A grid of a few coefficients: few elements, in many privatised copies.
TEST(SumsOfParts, LieAsTheParts) {
  const int size = 400, cells = 20;
  const Buffer<float> guide = gradient::random_image({size, size}, 0, 7, 1);
  const Buffer<float> grid = gradient::random_image({cells, cells, 8, 12}, -1, 1, 2);
  const Buffer<float> seed = gradient::random_image({size, size, 12}, -1, 1, 3);
  Var x("x"), y("y"), k("k");
  Func sliced("sliced");
  const Expr i = clamp(cast<int>(guide(x, y) * 2.5f), 0, cells - 1);
  const Expr j = clamp(cast<int>(guide(y, x) * 2.5f), 0, cells - 1);
  sliced(x, y, k) = grid(i, j, clamp(cast<int>(guide(x, y)), 0, 7), k);
  const Derivative d = propagate_adjoints(sliced, seed);
  Func adjoint = d(grid);
  adjoint.set_estimates({{0, cells}, {0, cells}, {0, 8}, {0, 12}});
  std::vector<std::string> layouts;
  for (const graph::FuncPtr& f :
       graph::topological_order(driver::schedule_unscheduled({adjoint.function()})))
    if (!f->schedule.storage_dims.empty() && f->schedule.storage_dims[0] != f->args[0])
      layouts.push_back(f->name);
  ASSERT_EQ(layouts.size(), 2u) << log_of({adjoint}).to_text();
  EXPECT_NE(layouts[0].find("_parts"), std::string::npos) << layouts[0];
  EXPECT_NE(layouts[1].find("_sum"), std::string::npos) << layouts[1];
  const Buffer<float> expected = in_plain_loops({adjoint}).realize({cells, cells, 8, 12})[0];
  expect_close(adjoint.realize({cells, cells, 8, 12}), expected);
}

// Two Funcs between the transposed read and its consumer are computed inline.
TEST(TransposedReads, AreSeenThroughWhatIsInline) {
  const Buffer<float> image = gradient::random_image({64, 64}, -1, 1, 1);
  const Buffer<float> other = gradient::random_image({64, 64}, -1, 1, 2);
  Var x("x"), y("y");
  Func turned("turned"), scaled("scaled"), sum("sum");
  RDom r(0, 64, 0, 64);
  turned(x, y) = image(y, x);
  scaled(x, y) = turned(x, y) * 2.0f;
  sum() = 0.0f;
  sum() += scaled(r.x, r.y) * other(r.x, r.y);
  const Derivative d = propagate_adjoints(sum);
  const graph::FuncPtr adjoint = driver::schedule_unscheduled({d(image).function()})[0];
  ASSERT_EQ(adjoint->pure->schedule.dims.size(), 4u) << log_of({d(image)}).to_text();
}

}  // namespace
}  // namespace retrograde
