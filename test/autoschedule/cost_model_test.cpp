// The cost model: its counts for programs with known costs.
#include <gtest/gtest.h>

#include "autoschedule/machine/machine.h"
#include "frontend/include/retrograde/retrograde.h"
#include "lower/lower.h"
#include "support/errors.h"
#include "tuning/memory_traffic.h"
#include "tuning/predict.h"

namespace retrograde {
namespace {

using planning::Machine;
using tuning::BufferShape;
using tuning::Work;
using tuning::WorkTree;

const Target avx512("x86-64-linux-avx512_skylake");

struct Counted {
  ir::LoweredFunction function;
  tuning::ProgramSizes sizes;
  WorkTree tree(int threads = 1) const {
    return tuning::work_tree(function, sizes, {64, 32, threads});
  }
  Work total() const { return tree().total(); }
};

Counted counted(const Func& f, const std::vector<int>& sizes) {
  const std::vector<graph::FuncPtr> outputs = {f.function()};
  lower::LowerOptions options;
  options.target = avx512;
  Counted result;
  result.function = lower::lower(f.name(), outputs, lower::infer_arguments(outputs), options);
  result.sizes = tuning::program_sizes(result.function, tuning::output_shapes(outputs, {sizes}));
  return result;
}

Machine machine() { return planning::constants_for(avx512); }

TEST(CostModel, AProductThatIsAddedIsOneOperationOfEachVector) {
  ImageParam in(Float(32), 1);
  Func f;
  Var x;
  f(x) = in(x)*2.0f + 1.0f;
  f.vectorize(x, 16);
  in.dim(0).set_estimate(0, 1024);
  const Work work = counted(f, {1024}).total();
  // And the overhead of a size that is no multiple of the vector width.
  EXPECT_NEAR(work.operations, 64, 1);
  EXPECT_EQ(work.loads, 64);
  EXPECT_EQ(work.stores, 64);
}

TEST(CostModel, DoublesFillTwiceAsManyVectors) {
  ImageParam in(Float(64), 1);
  Func f;
  Var x;
  f(x) = in(x) / in(x + 1);
  f.vectorize(x, 16);
  const Work work = counted(f, {1024}).total();
  EXPECT_EQ(work.double_divisions, 128);
  EXPECT_EQ(work.divisions, 0);
  EXPECT_EQ(work.loads, 256);
}

TEST(CostModel, FunctionsCountByThemselves) {
  ImageParam in(Float(32), 1);
  Func f;
  Var x;
  f(x) = exp(in(x)) + sqrt(in(x)) + pow(in(x), 1.5f);
  f.vectorize(x, 16);
  const Work work = counted(f, {160}).total();
  EXPECT_EQ(work.exps, 10);
  EXPECT_EQ(work.roots, 10);
  EXPECT_EQ(work.pows, 10);
  EXPECT_EQ(work.loads, 10);  // one place is loaded once
}

TEST(CostModel, PlacesThatDataDecideAreGatheredLaneByLane) {
  ImageParam places(Int(32), 1), table(Float(32), 1);
  Func f;
  Var x;
  f(x) = table(clamp(places(x), 0, 255));
  f.vectorize(x, 16);
  const Work work = counted(f, {256}).total();
  EXPECT_EQ(work.gather_lanes, 256);
  EXPECT_EQ(work.loads, 16);
}

// The lanes of such a vector are a period of the index, or all of them are in one.
TEST(CostModel, DividedPlacesAreGatheredUnlessTheyDivideEvenly) {
  const auto gathered = [](auto index) {
    ImageParam in(Float(32), 1);
    Func f;
    Var x;
    f(x) = in(index(x));
    f.vectorize(x, 16);
    return counted(f, {256}).total().gather_lanes;
  };
  EXPECT_EQ(gathered([](Expr x) { return x / 2; }), 0);
  EXPECT_EQ(gathered([](Expr x) { return x % 4; }), 0);
  EXPECT_EQ(gathered([](Expr x) { return x % 512; }), 0);
  EXPECT_EQ(gathered([](Expr x) { return x / 3; }), 256);
  EXPECT_EQ(gathered([](Expr x) { return 2 * x / 3; }), 256);
  EXPECT_EQ(gathered([](Expr x) { return x % 20; }), 256);
}

TEST(CostModel, AScatterThatIsNotVectorizedIsOfScalars) {
  ImageParam places(Int(32), 1);
  Func f;
  Var x;
  RDom r(0, 1000);
  f(x) = 0;
  f(clamp(places(r), 0, 15)) += 1;
  const Work work = counted(f, {16}).total();
  EXPECT_EQ(work.scatter_lanes, 0);
  EXPECT_NEAR(work.stores, 1000, 20);
}

TEST(CostModel, WhatALoopDoesNotChangeStandsOutsideOfIt) {
  ImageParam in(Float(32), 2), column(Float(32), 1);
  Func f;
  Var x, y;
  f(x, y) = in(x, y) * exp(column(y));
  f.vectorize(x, 16);
  const Work work = counted(f, {160, 7}).total();
  EXPECT_EQ(work.exps, 7);
}

TEST(CostModel, PartsOfALoopCountWithTheirTrips) {
  ImageParam in(Float(32), 1);
  Func f;
  Var x;
  Func inside = BoundaryConditions::repeat_edge(in, {{0, 1024}});
  f(x) = inside(x - 1) + inside(x + 1);
  f.vectorize(x, 16);
  const WorkTree tree = counted(f, {1024}).tree();
  double trips = 0, most = 0;
  for (const tuning::WorkNode& node : tree.nodes) {
    if (!node.is_loop()) continue;
    trips += node.trips;
    most = std::max(most, node.trips);
  }
  EXPECT_GE(most, 62);
  EXPECT_LE(trips, 66);
}

TEST(CostModel, AStageAtTwoPlacesIsChargedAtBoth) {
  const auto exps = [](bool twice) {
    Func f("f"), g("g"), h("h"), out("out");
    Var x, y;
    f(x, y) = exp(cast<float>(x + y));
    g(x, y) = f(x, y) * 2.0f;
    h(x, y) = f(x, y) * 3.0f;
    out(x, y) = g(x, y) + h(x, y);
    g.compute_root().vectorize(x, 16);
    h.compute_root().vectorize(x, 16);
    if (!twice) f.compute_root().vectorize(x, 16);
    const auto program = counted(out, {64, 64});
    const auto prediction = tuning::predict(program.function, program.sizes, machine(), 1);
    double sum = 0;
    for (const auto& stage : prediction.stages) sum += stage.seconds;
    EXPECT_DOUBLE_EQ(sum, prediction.seconds);
    return program.total().exps;
  };
  EXPECT_EQ(exps(false), 256);
  EXPECT_EQ(exps(true), 512);  // inline in both
}

TEST(CostModel, WhatStaysInACacheIsLoadedOnce) {
  ImageParam in(Float(32), 2);
  Func f("f"), out("out");
  Var x, y;
  f(x, y) = in(x, y) * 2.0f;
  out(x, y) = f(x, y) + f(x, y + 1);
  f.compute_root().vectorize(x, 16);
  out.vectorize(x, 16);
  const auto program = counted(out, {1024, 1024});
  const WorkTree tree = program.tree();
  const tuning::MemoryTraffic traffic(tree);
  const auto sum = [](const std::vector<tuning::Traffic>& stages) {
    double bytes = 0;
    for (const auto& stage : stages) bytes += stage.serial_bytes + stage.parallel_bytes;
    return bytes;
  };
  const double plane = 4.0 * 1024 * 1024;
  // One stage reads in and writes f (twice: it is stored); the other reads f and writes out
  // (twice). Rows are reused.
  EXPECT_NEAR(sum(traffic.behind(1 << 20)), 6 * plane, 0.1 * plane);
  EXPECT_EQ(sum(traffic.behind(1 << 26)), 0);  // over many calls
}

TEST(CostModel, ThreadsShareLoopsAsFarAsThereAreIterations) {
  Func f;
  Var x, y;
  f(x, y) = exp(cast<float>(x * y));
  f.parallel(y).vectorize(x, 16);
  const auto program = counted(f, {1024, 3});
  const WorkTree tree = program.tree(2);
  double speedup = 1;
  for (const tuning::WorkNode& node : tree.nodes) speedup = std::max(speedup, node.speedup);
  EXPECT_EQ(speedup, 1.5);  // 2 chunks, then 1
}

TEST(CostModel, ASumInMemoryWaitsForItself) {
  ImageParam in(Float(32), 1);
  Func f;
  RDom r(0, 4096);
  f() = 0.0f;
  f() += in(r);
  const auto program = counted(f, {});
  const double seconds = tuning::predicted_seconds(program.function, program.sizes, machine());
  EXPECT_GE(seconds, 4096 * machine().latency_ns * 1e-9);
}

TEST(CostModel, TheSameProgramHasTheSameTime) {
  ImageParam in(Float(32), 2);
  Func f;
  Var x, y;
  f(x, y) = in(x, y) + in(x + 1, y) * in(x, y + 3);
  f.vectorize(x, 16).parallel(y);
  const auto program = counted(f, {512, 512});
  const double seconds = tuning::predicted_seconds(program.function, program.sizes, machine());
  EXPECT_GT(seconds, 0);
  for (int i = 0; i < 3; i++)
    EXPECT_EQ(tuning::predicted_seconds(program.function, program.sizes, machine()), seconds);
}

TEST(CostModel, SizesAreOfEachDimension) {
  Func f("f");
  Var x, y;
  f(x, y) = x + y;
  expect_error({"sizes are given once for all outputs, or for each, one for each dimension"},
               [&] { tuning::output_shapes({f.function()}, {{3}}); });
}

// ---- the report ----

TEST(ExplainSchedule, NamesStagesWithPredictedAndMeasuredTimes) {
  ImageParam in(Float(32), 2);
  Func blur("blur"), out("out");
  Var x("x"), y("y");
  blur(x, y) = in(x, y) + in(x + 1, y);
  out(x, y) = blur(x, y) + blur(x, y + 1);
  blur.compute_root().vectorize(x, 16);
  Buffer<float> image(130, 130);
  image.fill(1.0f);
  in.set(image);
  const Pipeline pipeline(out);
  const ScheduleReport predicted = pipeline.explain_schedule(Target(), {128, 128});
  EXPECT_FALSE(predicted.measured_ms.has_value());
  EXPECT_GT(predicted.predicted_ms, 0);
  const ScheduleReport both =
      pipeline.explain_schedule(Target(), {128, 128}, {.measure = true, .seconds = 0.05});
  ASSERT_TRUE(both.measured_ms.has_value());
  EXPECT_EQ(both.predicted_ms, predicted.predicted_ms);
  EXPECT_NE(both.schedule.find("blur.compute_at"), std::string::npos);
  EXPECT_GE(both.first_call_ms, 0);
  EXPECT_FALSE(both.machine.empty());
  for (const ScheduleReport::Stage& stage : both.stages) {
    EXPECT_GE(stage.bytes, stage.memory_bytes) << stage.name;
    EXPECT_FALSE(stage.bound_by.empty() && stage.predicted_ms > 0) << stage.name;
    EXPECT_TRUE(!stage.measured_ms || *stage.measured_ms >= 0) << stage.name;
  }
  EXPECT_NE(both.to_json().find("\"predicted_ms\""), std::string::npos);
  const std::string text = both.to_string();
  for (const char* part : {"blur.compute_at", "predicted ms", "out", "total", "machine:"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST(ExplainSchedule, TakesBuffersAndEstimates) {
  ImageParam in(Float(32), 1);
  Func f("f");
  Var x("x");
  f(x) = in(x)*2.0f;
  f.set_estimate(x, 0, 1000);
  Buffer<float> image(5000), result(5000);
  image.fill(1.0f);
  in.set(image);
  const Pipeline pipeline(f);
  const double estimated = pipeline.explain_schedule().predicted_ms;
  ExplainOptions options;
  options.measure = true;
  options.seconds = 0.01;
  options.threads = 1;
  const ScheduleReport given =
      pipeline.explain_schedule(std::vector<Buffer<>>{result}, Target(), options);
  EXPECT_GT(given.predicted_ms, 2 * estimated);
  EXPECT_EQ(result(4999), 2.0f);
}

}  // namespace
}  // namespace retrograde
