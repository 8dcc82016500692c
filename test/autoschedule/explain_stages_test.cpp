// The stages of a pipeline in plain words: their loops, what bounds them, storage and hints.
#include "driver/reports.h"

#include <gtest/gtest.h>

#include "frontend/include/retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

using tuning::ExplainedPipeline;
using tuning::ExplainedStage;
using Sizes = std::vector<int>;

const Target explained_target("x86-64-linux-avx512_skylake");

ExplainedPipeline explained(const Func& f, const Sizes& sizes,
                            const std::map<std::string, Sizes>& input_sizes = {}) {
  return driver::explain_stages(Pipeline(f).spec(), explained_target, {sizes}, input_sizes);
}

ExplainedStage stage_of(const ExplainedPipeline& all, const std::string& name) {
  for (const ExplainedStage& stage : all.stages)
    if (stage.name == name) return stage;
  ADD_FAILURE() << "no stage " << name;
  return {};
}

bool mentions(const std::vector<std::string>& texts, const std::string& part) {
  return std::ranges::any_of(
      texts, [&](const std::string& one) { return one.find(part) != std::string::npos; });
}

TEST(ExplainStages, LoopsHaveTheNamesOfTheUsersVariables) {
  ImageParam in(Float(32), 2, "in");
  Func blur("told_blur"), out("told_out");
  blur(x, y) = in(x, y) + in(x + 1, y);
  out(x, y) = blur(x, y) + blur(x, y + 1);
  out.parallel(y).vectorize(x, 8);
  blur.compute_at(out, y).vectorize(x, 16);
  const ExplainedPipeline all = explained(out, {128, 64}, {{"in", {129, 65}}});
  EXPECT_EQ(
      stage_of(all, "told_out").loops,
      std::vector<std::string>{"definition: y in parallel (64), x (16), vectors of 8 along x"});
  EXPECT_EQ(stage_of(all, "told_blur").loops,
            std::vector<std::string>{"definition: inside \"told_out\" over y in parallel (64): y "
                                     "(2), x (8), vectors of 16 along x"});
  EXPECT_GT(all.ms, 0);
  EXPECT_FALSE(all.machine.empty());
}

TEST(ExplainStages, FusedAndUnrolledLoopsToo) {
  Func f("told_fused");
  Var c("c"), both("both");
  f(c, x, y) = cast<float>(c + x * y);
  f.bound(c, 0, 3).unroll(c).fuse(x, y, both).parallel(both);
  EXPECT_EQ(stage_of(explained(f, {3, 8, 4}), "told_fused").loops,
            std::vector<std::string>{"definition: x and y in parallel (32), c unrolled (3)"});
}

TEST(ExplainStages, SizesOfInputsCountTheTermsOfSums) {
  ImageParam in(Float(32), 1, "in");
  Func sum("told_sum");
  RDom r(0, in.dim(0).extent(), "r");
  sum() = 0.0f;
  sum() += in(r);
  const ExplainedStage stage = stage_of(explained(sum, {}, {{"in", {5000}}}), "told_sum");
  EXPECT_TRUE(mentions(stage.loops, "r.x one after the other (5000)")) << stage.loops.back();
}

TEST(ExplainStages, RecurrencesAreSerialChains) {
  ImageParam in(Float(32), 1, "in");
  Func scan("told_scan");
  RDom r(1, 999, "r");
  scan(x) = in(x);
  scan(r) = scan(r - 1) * 0.5f + in(r);
  const ExplainedStage stage = stage_of(explained(scan, {1000}), "told_scan");
  EXPECT_EQ(stage.bound, "a serial chain");
  ASSERT_FALSE(stage.hints.empty());
  EXPECT_TRUE(mentions(stage.hints, "of earlier iterations, so 999 iterations run one after"))
      << stage.hints[0];
  EXPECT_TRUE(mentions(stage.hints, "on one thread")) << stage.hints[0];
}

TEST(ExplainStages, SumsIntoOneElementAreNoRecurrences) {
  ImageParam in(Float(32), 2, "in");
  Func sum("told_rows");
  RDom r(0, 64, "r");
  sum(y) = 0.0f;
  sum(y) += in(r, y);
  const ExplainedStage stage = stage_of(explained(sum, {1000}), "told_rows");
  EXPECT_FALSE(mentions(stage.hints, "earlier iterations"));
}

TEST(ExplainStages, GathersLoadSingleElements) {
  ImageParam table(Float(32), 1, "table"), index(Int(32), 1, "index");
  Func out("told_gather");
  out(x) = table(clamp(index(x), 0, 1023));
  out.vectorize(x, 16);
  const ExplainedStage stage = stage_of(explained(out, {4096}, {{"table", {1024}}}), "told_gather");
  EXPECT_EQ(stage.bound, "loads and stores of single elements");
  EXPECT_TRUE(mentions(stage.hints, "element by element"));
}

TEST(ExplainStages, LargeImagesAreBoundByMemory) {
  ImageParam in(Float(32), 2, "in");
  Func out("told_copy");
  out(x, y) = in(x, y) * 2.0f;
  out.parallel(y).vectorize(x, 16);
  const ExplainedStage stage = stage_of(explained(out, {8192, 8192}), "told_copy");
  EXPECT_EQ(stage.bound.rfind("memory traffic, ", 0), 0u) << stage.bound;
  EXPECT_NE(stage.bound.find("B from memory"), std::string::npos) << stage.bound;
}

TEST(ExplainStages, SayWhatIsStoredAndWhatIsRecomputed) {
  ImageParam in(Float(32), 1, "in");
  Func inlined("told_inlined"), stored("told_stored"), out("told_result");
  inlined(x) = exp(in(x));
  stored(x) = inlined(x) + inlined(x + 1);
  out(x) = stored(x) + stored(x + 1);
  stored.compute_root();
  const ExplainedPipeline all = explained(out, {1000}, {{"in", {1002}}});
  EXPECT_EQ(all.recomputed, std::vector<std::string>{"told_inlined"});
  ASSERT_EQ(all.stored.size(), 1u);
  EXPECT_EQ(all.stored[0].name, "told_stored");
  EXPECT_NEAR(all.stored[0].bytes, 4 * 1001, 256);
}

}  // namespace
}  // namespace retrograde
