// Tests the options of the autoscheduler: each decision switched off, Funcs to store and to inline, a number of
// threads. Schedules must be legal, and results must agree with the interpreter.
#include "frontend/schedule/autoschedule_options.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "autodiff/derivative.h"
#include "frontend/language/func.h"
#include "frontend/run/pipeline.h"
#include "frontend/run/warnings.h"
#include "gradient/gradient_check.h"
#include "graph/copy_graph.h"
#include "ir/target.h"
#include "support/errors.h"
#include "support/loop_nest.h"
#include "support/same_numbers.h"

namespace retrograde {
namespace {

using gradient::random_image;

struct Program {
  std::vector<Func> outputs;
  std::vector<std::vector<int>> sizes;
  bool has_estimates = true;
};

// An image smoothed down and across, the weighted sum of its squares, and the gradient of that sum.
Program stencils() {
  const Buffer<float> image = random_image({90, 70}, -1, 1, 1);
  Var x("x"), y("y");
  Func padded = BoundaryConditions::repeat_edge(image);
  Func across("across"), down("down"), curved("curved");
  across(x, y) = exp(padded(x - 1, y)) + padded(x, y) * padded(x + 1, y);
  down(x, y) = across(x, y - 1) * 0.25f + across(x, y) * 0.5f + across(x, y + 1) * 0.25f;
  curved(x, y) = sin(down(x - 1, y)) + cos(down(x + 1, y + 1));
  const Func loss = gradient::weighted_sum(curved, {80, 60});
  return {{loss, propagate_adjoints(loss)(image)}, {{}, {90, 70}}};
}

// The same smoothing without a gradient, of an image of any size.
Program smoothing() {
  ImageParam image(Float(32), 2);
  image.set(random_image({70, 50}, -1, 1, 1));
  Var x("x"), y("y");
  Func sharp("sharp"), across("across"), down("down");
  sharp(x, y) = exp(image(x, y));
  across(x, y) = sin(sharp(x, y)) + sin(sharp(x + 1, y)) * sharp(x + 2, y);
  down(x, y) = across(x, y) * across(x, y + 1) + across(x, y + 2);
  return {{down}, {{60, 40}}, false};
}

// Convolution layers that mix channels.
Program convolution() {
  const Buffer<float> image = random_image({40, 24, 6}, -1, 1, 1);
  const Buffer<float> weights = random_image({3, 3, 6, 8}, -1, 1, 2);
  const Buffer<float> seed = random_image({38, 22, 8}, -1, 1, 3);
  Var x("x"), y("y"), c("c");
  RDom k(0, 3, 0, 3, 0, 6);
  Func layer("layer");
  layer(x, y, c) = 0.0f;
  layer(x, y, c) += weights(k.x, k.y, k.z, c) * image(x + k.x, y + k.y, k.z);
  const Derivative d = propagate_adjoints(layer, seed);
  return {{layer, d(image), d(weights)}, {{38, 22, 8}, {40, 24, 6}, {3, 3, 6, 8}}};
}

// A matrix product of many rows, whose tiles read pieces of them.
Program product() {
  const Buffer<float> left = random_image({96, 80}, -1, 1, 1);
  const Buffer<float> right = random_image({64, 96}, -1, 1, 2);
  Var x("x"), y("y");
  RDom k(0, 96);
  Func squared("squared"), sums("sums");
  squared(x, y) = right(x, y) * right(x, y);
  sums(x, y) += left(k, y) * squared(x, k);
  const Derivative d = propagate_adjoints(gradient::weighted_sum(sums, {64, 80}));
  return {{sums, d(left), d(right)}, {{64, 80}, {96, 80}, {64, 96}}};
}

// An image read at data-dependent indices.
Program warp() {
  const int size = 40, channels = 16;
  const Buffer<float> image = random_image({size, size, channels}, -1, 1, 1);
  const Buffer<float> flow = random_image({size, size, 2}, -5, 5, 2);
  const Buffer<float> seed = random_image({size, size, channels}, -1, 1, 3);
  const Func warped = gradient::bilinear_warp(image, flow);
  const Derivative d = propagate_adjoints(warped, seed);
  return {{warped, d(image), d(flow)},
          {{size, size, channels}, {size, size, channels}, {size, size, 2}}};
}

// A selection among sums and differences, read at constant indices.
Program bands() {
  const Buffer<float> image = random_image({60, 40}, -1, 1, 1);
  Var x("x"), y("y"), b("b");
  Func padded = BoundaryConditions::repeat_edge(image);
  Func band("band"), out("out");
  const Expr first = exp(padded(2 * x, y)), second = exp(padded(2 * x + 1, y));
  band(x, y, b) = mux(b, {first + second, first - second, first * second});
  out(x, y) = band(x, y, 0) * band(x + 1, y, 2) + band(x, y + 1, 1) * band(x, y, 2);
  const Func loss = gradient::weighted_sum(out, {28, 38});
  return {{loss, propagate_adjoints(loss)(image)}, {{}, {60, 40}}};
}

// Differences between an image and shifted copies of itself, each smoothed; few planes, and transposed reads.
Program shifts() {
  const Buffer<float> image = random_image({44, 30}, -1, 1, 1);
  Var x("x"), y("y"), s("s");
  RDom near(-1, 3), each(0, 9);
  Func across("across"), smooth("smooth"), out("out");
  const Expr xc = clamp(x, 0, 43), yc = clamp(y, 0, 29);
  across(x, y, s) = 0.0f;
  across(x, y, s) += exp(image(clamp(x + near + s - 4, 0, 43), yc) - image(xc, yc));
  smooth(x, y, s) = 0.0f;
  smooth(x, y, s) += across(x, y + near, s);
  out(x, y) = 0.0f;
  out(x, y) += smooth(y, x, each) * cast<float>(each + 1);
  const Derivative d = propagate_adjoints(gradient::weighted_sum(out, {30, 44}));
  return {{out, d(image)}, {{30, 44}, {44, 30}}};
}

const std::map<std::string, std::function<Program()>>& programs() {
  static const std::map<std::string, std::function<Program()>> all{
      {"stencils", stencils}, {"smoothing", smoothing}, {"convolution", convolution},
      {"product", product},   {"warp", warp},           {"shifts", shifts},
      {"bands", bands}};
  return all;
}

std::vector<std::string> names_of_programs() {
  std::vector<std::string> names;
  for (const auto& [name, make] : programs()) names.push_back(name);
  return names;
}

// Expected values of all outputs, evaluated point by point in double.
const std::vector<oracle::Array>& expected_of(const std::string& name) {
  static std::map<std::string, std::vector<oracle::Array>> known;
  std::vector<oracle::Array>& result = known[name];
  if (!result.empty()) return result;
  const Program program = programs().at(name)();
  for (size_t i = 0; i < program.outputs.size(); ++i) {
    oracle::Region region;
    region.mins.assign(program.sizes[i].size(), 0);
    region.extents.assign(program.sizes[i].begin(), program.sizes[i].end());
    result.push_back(gradient::evaluate(program.outputs[i], region));
  }
  return result;
}

std::vector<Buffer<>> buffers_of(const Program& program) {
  std::vector<Buffer<>> buffers;
  for (const std::vector<int>& sizes : program.sizes) buffers.push_back(Buffer<float>(sizes));
  return buffers;
}

void expect_right(const std::string& name, Pipeline pipeline, const std::string& how) {
  const std::vector<oracle::Array>& expected = expected_of(name);
  std::vector<Buffer<>> found = buffers_of(programs().at(name)());
  pipeline.realize(found);
  for (size_t i = 0; i < found.size(); ++i) {
    size_t next = 0, wrong = 0;
    Buffer<float>(found[i]).get()->for_each_value([&](float value) {
      const double wanted = expected[i].values[next++].scalar.as_double();
      if (!(std::abs(value - wanted) <= 1e-4 * (1 + std::abs(wanted)))) ++wrong;
    });
    EXPECT_EQ(wrong, 0u) << "output " << i << " of " << name << " " << how;
  }
}

void set_estimates(const Program& program) {
  for (size_t i = 0; i < program.outputs.size(); ++i) {
    Func output = program.outputs[i];
    for (size_t d = 0; d < program.sizes[i].size(); ++d)
      output.set_estimate(output.args()[d], 0, program.sizes[i][d]);
  }
}

// The parameters of a machine with small caches, so that small programs meet the rules for large ones.
const MachineParams small_machine(2, 8 << 10, 40);

Pipeline scheduled_without(const std::string& name, const std::set<Decision>& without) {
  const Program program = programs().at(name)();
  if (program.has_estimates) set_estimates(program);
  AutoscheduleOptions options;
  options.without = without;
  const Pipeline pipeline(program.outputs);
  pipeline.auto_schedule(get_host_target(), options, small_machine);
  return pipeline;
}

std::string log_of(const Pipeline& pipeline) {
  return same_numbers(pipeline.schedule_log().to_text());
}
std::string log_of(const std::string& name, const std::set<Decision>& without) {
  return log_of(scheduled_without(name, without));
}

// One case for each program; its expected values are interpreted once, and each schedule runs once.
class EachProgram : public ::testing::TestWithParam<std::string> {
 protected:
  // Whether the schedule is one that did not run before.
  bool expect_right_without(const std::set<Decision>& without) {
    const Pipeline pipeline = scheduled_without(GetParam(), without);
    if (!schedules_.insert(log_of(pipeline)).second) return false;
    std::string how = "scheduled without";
    for (const Decision decision : without) how += " " + to_string(decision);
    expect_right(GetParam(), pipeline, how);
    return true;
  }

 private:
  std::set<std::string> schedules_;
};

TEST_P(EachProgram, IsRightWithoutAnyOfTheDecisions) {
  const std::string& name = GetParam();
  expect_right_without({});
  std::set<Decision> all;
  for (const Decision decision : all_decisions()) {
    all.insert(decision);
    if (!expect_right_without({decision})) continue;
    const Program program = programs().at(name)();
    Pipeline pipeline(program.outputs);
    AutoscheduleOptions options;
    options.without = {decision};
    pipeline.set_autoschedule(options);
    expect_right(name, pipeline, "compiled without " + to_string(decision));
  }
  expect_right_without(all);
}

TEST_P(EachProgram, IsRightAndPredictedNoSlowerWhenItsScheduleIsSearched) {
  const Program program = programs().at(GetParam())();
  set_estimates(program);
  AutoscheduleOptions options;
  options.search = true;
  options.deterministic = false;
  const Pipeline pipeline(program.outputs);
  const SearchedSchedules found =
      pipeline.auto_schedule(get_host_target(), options, small_machine).search;
  expect_right(GetParam(), pipeline, "searched");
  EXPECT_GT(found.tried, 1u) << found.note;
  EXPECT_LE(found.predicted_ms, found.default_ms);
}

INSTANTIATE_TEST_SUITE_P(Options, EachProgram, ::testing::ValuesIn(names_of_programs()),
                         [](const auto& info) { return info.param; });

TEST(AutoscheduleOptions, EachDecisionShowsInSomeSchedule) {
  std::map<std::string, std::string> with_all;
  for (const auto& [name, make] : programs()) with_all[name] = log_of(name, {});
  for (const Decision decision : all_decisions()) {
    const bool changes = std::ranges::any_of(
        with_all, [&](const auto& log) { return log.second != log_of(log.first, {decision}); });
    EXPECT_TRUE(changes) << "no program shows what " << to_string(decision) << " decides";
  }
}

struct Places : ::testing::Test {
  Places() {
    cheap(x, y) = image(x, y) * 2.0f;
    heavy(x, y) = exp(cheap(x, y)) * sin(cheap(x, y));
    out(x, y) = heavy(x, y) + heavy(x + 1, y) + heavy(x, y + 1);
    sums(x) += out(x, rows);
  }
  std::string scheduled(const AutoscheduleOptions& options) {
    return Pipeline(sums).auto_schedule(get_host_target(), options).schedule_source;
  }
  static bool is_at_root(const Func& f) {
    return f.function()->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
  }
  Buffer<float> image = random_image({40, 40}, -1, 1, 1);
  Var x{"x"}, y{"y"};
  RDom rows{0, 30};
  Func cheap{"cheap"}, heavy{"heavy"}, out{"out"}, sums{"sums"};
};

TEST_F(Places, FuncsAreStoredAndInlinedAsTold) {
  AutoscheduleOptions options;
  options.store = {FuncName(cheap)};
  options.inlined = {FuncName(heavy.name())};
  EXPECT_EQ(options.store[0], FuncName(cheap.name()));
  EXPECT_EQ(options.inlined[0].name, heavy.name());
  scheduled(options);
  EXPECT_TRUE(is_at_root(cheap));
  EXPECT_FALSE(is_at_root(heavy));
}

TEST_F(Places, WhatAUserScheduledStays) {
  heavy.compute_root().vectorize(x, 4);
  AutoscheduleOptions options;
  options.inlined = {heavy};
  const std::string source = scheduled(options);
  EXPECT_TRUE(is_at_root(heavy));
  EXPECT_EQ(source.find("heavy."), std::string::npos) << source;
}

// rule: options of the autoscheduler name Funcs of the pipeline
// rule: what is inlined has one pure definition and is no output
TEST_F(Places, RefuseWhatCannotBe) {
  const auto refuse = [&](const AutoscheduleOptions& options,
                          std::initializer_list<std::string_view> words) {
    try {
      scheduled(options);
      ADD_FAILURE() << "no error";
    } catch (const CompileError& error) {
      expect_mentions(error.what(), words);
    }
  };
  refuse({.store = {"hevy"}},
         {"\"hevy\"", "options of the autoscheduler name Funcs of the pipeline", heavy.name()});
  refuse({.inlined = {sums}},
         {sums.name(), "what is inlined has one pure definition and is no output", "output"});
  refuse({.store = {heavy}, .inlined = {heavy}}, {heavy.name(), "a Func is stored or inlined"});
}

TEST_F(Places, BoundsOfWhatIsStoredAreKnown) {
  ImageParam places(Int(32), 1);
  Func read("read");
  read(x) = cheap(places(x), 0) + places(x);
  AutoscheduleOptions options;
  options.store = {cheap};
  try {
    Pipeline(read).auto_schedule(get_host_target(), options);
    ADD_FAILURE() << "no error";
  } catch (const CompileError& error) {
    expect_mentions(error.what(), {cheap.name(), "what is stored has bounds that are known"});
  }
}

// Each level reads the one before at nine places: inlining seven of them makes 9^7 copies.
TEST_F(Places, BodiesThatGrowWithoutEndAreNotInlined) {
  Func last = cheap;
  AutoscheduleOptions options;
  for (int i = 0; i < 7; ++i) {
    Func next("level");
    Expr sum = 0.0f;
    for (int k = 0; k < 9; ++k) sum += last(x + k % 3, y + k / 3) * last(x - k, y);
    next(x, y) = sum;
    if (i > 0) options.inlined.emplace_back(last);
    last = next;
  }
  try {
    Pipeline(last).auto_schedule(get_host_target(), options);
    ADD_FAILURE() << "no error";
  } catch (const CompileError& error) {
    expect_mentions(error.what(), {"what is inlined stays small enough to compile"});
  }
}

size_t count_of(const std::string& word, const std::string& text) {
  size_t count = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

TEST_F(Places, LoopsAreTasksForSoManyThreads) {
  const auto parallel_loops = [&](const AutoscheduleOptions& options,
                                  const MachineParams& machine) {
    Func planes("planes");
    Var c("c"), n("n");
    planes(x, y, c, n) = exp(image(x, y)) * cast<float>(c + n);
    planes.set_estimates({{0, 400}, {0, 400}, {0, 4}, {0, 3}});
    Pipeline pipeline(planes);
    pipeline.auto_schedule(get_host_target(), options, machine);
    return count_of("parallel", pipeline.loop_nest());
  };
  const MachineParams generic = MachineParams::generic();
  EXPECT_GE(parallel_loops({}, generic), 1u);
  EXPECT_EQ(parallel_loops({.threads = 1}, generic), 0u);
  EXPECT_GE(parallel_loops({.threads = 16}, generic), 1u);
  EXPECT_EQ(parallel_loops({.without = {Decision::TaskSizes}}, generic), 1u);
  EXPECT_EQ(parallel_loops({.threads = 1}, MachineParams(16, 1 << 20, 40)), 0u);
}

TEST_F(Places, OptionsAreText) {
  AutoscheduleOptions options;
  options.without = {Decision::Strips, Decision::Slices};
  options.store = {heavy, "a$1"};
  options.inlined = {"cheap"};
  options.threads = 3;
  options.memory_budget = 5000000000;
  options.search = true;
  options.deterministic = false;
  EXPECT_EQ(options.to_string(), "without=slices+strips,store=" + heavy.name() +
                                     "+a$1,inline=cheap,threads=3,memory=5000000000,"
                                     "search=true,deterministic=false");
  EXPECT_EQ(AutoscheduleOptions::from_string(options.to_string()), options);
  EXPECT_EQ(AutoscheduleOptions::from_string(""), AutoscheduleOptions());
}

// rule: search and deterministic are true or false
TEST(AutoscheduleOptions, RefuseTruthInOtherWords) {
  for (const std::string part : {"search=yes", "deterministic=", "search"}) {
    try {
      AutoscheduleOptions::from_string(part);
      ADD_FAILURE() << part;
    } catch (const CompileError& error) {
      expect_mentions(error.what(),
                      {part, "search and deterministic are true or false", "search=true"});
    }
  }
}

// A program is recompiled if its options change.
TEST(AutoscheduleOptionsOfGradients, TakeEffectWhenItIsCompiledNext) {
  const Buffer<float> image = random_image({500, 400}, -1, 1, 1);
  Var x("x"), y("y");
  Func values("values");
  values(x, y) = exp(image(x, y)) * sin(image(x, y));
  Func gradient = propagate_adjoints(gradient::weighted_sum(values, {500, 400}))(image);
  EXPECT_FALSE(names_in_nest(gradient.loop_nest(), "parallel").empty());
  const Buffer<float> first = gradient.realize({500, 400});
  gradient.set_autoschedule({.threads = 1});
  EXPECT_EQ(names_in_nest(gradient.loop_nest(), "parallel"), std::vector<std::string>());
  const Buffer<float> second = gradient.realize({500, 400});
  second.for_each_element([&](int i, int j) {
    EXPECT_NEAR(first(i, j), second(i, j), 1e-4 * (1 + std::abs(first(i, j))));
  });
}

TEST_F(Places, ACompiledGradientThatNobodyScheduledIsNoted) {
  Func gradient = propagate_adjoints(gradient::weighted_sum(sums, {30}))(image);
  std::vector<std::string> told;
  WarningScope scope([&](const std::string& warning) { told.push_back(warning); });
  gradient.compile_jit();
  ASSERT_EQ(told.size(), 1u);
  expect_mentions(told[0], {"performance", gradient.name(), "auto_schedule", "set_autoschedule",
                            "unscheduled()"});
  Pipeline chosen(gradient);
  chosen.unscheduled();
  EXPECT_TRUE(warnings_of(chosen).empty());
}

}  // namespace
}  // namespace retrograde
