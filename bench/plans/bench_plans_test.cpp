// Pairs of plans whose times are known (test/golden/pairs): cost models order them as measured, except those models
// that a pair names. Also the texts of pairs, programs that were kept, and samples of their plans.
// RETROGRADE_UPDATE_GOLDEN=1 writes the models that are wrong into the pairs; read the difference before you commit it.
#include <HalideRuntime.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <set>

#include "driver/keep_graph.h"
#include "frontend/include/retrograde/retrograde.h"
#include "loaded_program.h"
#include "models.h"
#include "pair_file.h"
#include "plan_sample.h"
#include "support/errors.h"
#include "support/golden_files.h"
#include "tuning/measure_schedule.h"

namespace bench::plans {
namespace {

namespace fs = std::filesystem;
using retrograde::expect_error;
using retrograde::read_file;

// Prices do not depend on the processor that runs the test.
const Target target("x86-64-linux-avx-avx2-avx512-avx512_skylake-f16c-fma-sse41");

class Pairs : public ::testing::TestWithParam<fs::path> {};

std::string words(const std::set<std::string>& names) {
  std::string result;
  for (const std::string& name : names) result += "  " + name;
  return result;
}

// The text of a pair with other models in its line "wrong".
std::string with_wrong(const std::string& text, const std::set<std::string>& models) {
  const size_t at = text.find("\nwrong") + 1;
  return text.substr(0, at) + "wrong" + words(models) + text.substr(text.find('\n', at));
}

TEST_P(Pairs, AreOrderedAsMeasured) {
  const std::string text = read_file(GetParam());
  const PlanPair pair = parse_pair(text);
  ASSERT_GT(pair.factor(), 1);
  std::set<std::string> wrong;
  std::string prices;
  for (const auto& [name, model] : all_models(planning::reference_machine(target), target)) {
    const double fast = model(pair.fast).seconds, slow = model(pair.slow).seconds;
    // Prices that are nearly equal may change sides with the processor, which decides how loops are lowered.
    const bool is_near = std::abs(fast - slow) < 0.02 * slow;
    if (is_near ? pair.wrong.contains(name) : fast >= slow) wrong.insert(name);
    prices += retrograde::text("\n", name, ": ", 1e3 * fast, " ms, ", 1e3 * slow, " ms");
  }
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN"))
    std::ofstream(GetParam()) << with_wrong(text, wrong);
  else
    EXPECT_EQ(words(wrong), words(pair.wrong)) << "fast and slow plan" << prices;
}

TEST_P(Pairs, AreWrittenAsTheyAreRead) {
  const std::string text = read_file(GetParam());
  const auto plans_of = [](const std::string& pair) { return pair.substr(pair.find("\n===")); };
  EXPECT_EQ(plans_of(to_text(parse_pair(text))), plans_of(text));
}

TEST_P(Pairs, KeepTheInvariantsOfPlans) {
  const PlanPair pair = parse_pair(read_file(GetParam()));
  EXPECT_EQ(broken_invariant(pair.fast), "");
  EXPECT_EQ(broken_invariant(pair.slow), "");
}

INSTANTIATE_TEST_SUITE_P(Files, Pairs,
                         ::testing::ValuesIn(retrograde::files_below(BENCH_PAIRS, ".pair")),
                         [](const auto& info) { return info.param.stem().string(); });

TEST(PairFiles, WhatIsNoneIsRefused) {
  expect_error({"there is no section"}, [] { parse_pair("program  f\n=== fast graph\n"); });
  expect_error({"there is no \"quick\""}, [] { parse_pair("quick  1 ms\n"); });
  expect_error({"a time in ms is missing"}, [] { parse_pair("fast  soon\n"); });
}

// A matrix product and a consumer, which have several schedules. The second matrix is read through a Func.
const std::string program = R"(image float32 left(2)
  estimates(0, 0, 256)
  estimates(1, 0, 256)
image float32 right(2)
  estimates(0, 0, 256)
  estimates(1, 0, 256)
  reader right_im
func right_im(x, y) float32
  define
    value image right(x, y)
func product(x, y) float32
  define
    value 0f
  update
    place x
    place y
    loop(k, 0, 256)
    value product(x, y) + image left(k, y) * right_im(x, k)
func out(x, y) float32
  define
    value exp(product(x, y)) + product(x, y + 1) + product(x, y + 2)
  schedule
    set_estimate(x, 0, 250)
    set_estimate(y, 0, 250)
output out
)";

std::vector<std::string> keys_of_sample() {
  const LoadedProgram loaded = load_program(program);
  const SampleOptions options{target, planning::reference_machine(target)};
  std::vector<std::string> keys;
  for (const SampledPlan& plan : sample_plans(loaded.outputs, options)) keys.push_back(plan.key);
  return keys;
}

TEST(Samples, BeginWithTheDefaultScheduleAndHaveEachPlanOnce) {
  const LoadedProgram loaded = load_program(program);
  const auto plans = sample_plans(loaded.outputs, {target, planning::reference_machine(target)});
  ASSERT_GT(plans.size(), 3u);
  EXPECT_TRUE(plans[0].source.starts_with("default"));
  std::set<std::string> texts, sources;
  int beams = 0;
  for (const SampledPlan& plan : plans) {
    EXPECT_TRUE(texts.insert(to_text(plan.plan)).second);
    EXPECT_EQ(broken_invariant(plan.plan), "");
    sources.insert(plan.source.substr(0, plan.source.find_first_of(" ,")));
    beams += plan.source.find("beam 1") != std::string::npos;
  }
  EXPECT_TRUE(sources.contains("without") && sources.contains("walk"));
  EXPECT_EQ(beams, 1);
}

TEST(LoadedPrograms, HaveImagesAsLargeAsTheOutputsNeed) {
  const LoadedProgram loaded = load_program(R"(image float32 input(1)
param float32 factor
func out(x) float32
  define
    value image input(x + 3) * factor
  schedule
    set_estimate(x, 0, 50)
output out
)");
  for (const auto& p : retrograde::graph::parameters_of(loaded.outputs)) {
    if (!p->is_buffer) continue;
    EXPECT_EQ(p->buffer->dim[0].min, 3);
    EXPECT_EQ(p->buffer->dim[0].extent, 50);
  }
}

TEST(Samples, RunOnBoundInputs) {
  const LoadedProgram loaded = load_program(program);
  const Target host = retrograde::get_jit_target_from_environment();
  const auto plans = sample_plans(loaded.outputs, {host, planning::reference_machine(host)});
  const retrograde::tuning::CompiledSchedule compiled(planning::emit_plan(plans[0].plan), host, 0);
  EXPECT_GT(compiled.run(), 0);
}

TEST(LoadedPrograms, HaveTheValuesThatWereKept) {
  using namespace retrograde;
  Buffer<float> weights(3);
  for (int i = 0; i < 3; ++i) weights(i) = 0.25f * static_cast<float>(i + 1);
  ImageParam table(Float(32), 1, "table"), image(Float(32), 1, "image");
  Param<int> count("count");
  table.set(weights);
  count.set(7);
  image.dim(0).set_estimate(0, 100);
  Var x("x");
  Func out("out");
  out(x) = table(clamp(x, 0, 2)) * count + image(x);
  out.set_estimate(x, 0, 100);

  const fs::path folder = testing::TempDir() + "kept_graphs_" + std::to_string(getpid());
  fs::create_directories(folder);
  setenv("RETROGRADE_GRAPHS", folder.c_str(), 1);
  driver::keep_graph("out", {out.function()});
  unsetenv("RETROGRADE_GRAPHS");
  const fs::path path = files_below(folder, ".graph").at(0);
  const LoadedProgram loaded = load_program(read_file(path), read_file(path.string() + ".values"));
  fs::remove_all(folder);
  int found = 0;
  for (const auto& p : graph::parameters_of(loaded.outputs)) {
    if (p->name == "count") found += p->value && p->value->i == 7;
    if (p->name == "table") found += reinterpret_cast<const float*>(p->buffer->host)[2] == 0.75f;
    if (p->name == "image") found += p->buffer->dim[0].extent == 100;
  }
  EXPECT_EQ(found, 3);
}

TEST(Samples, AreTheSameEachTime) { EXPECT_EQ(keys_of_sample(), keys_of_sample()); }

}  // namespace
}  // namespace bench::plans
