// Tests propagate_adjoints on random programs that are designed to break it. Each gradient in a fixed set is right or
// refused, according to the oracle of adversary/check.h (differences in double, forward against reverse mode, machine
// code against the interpreter).
//
// The oracle itself is tested as well: it finds a wrong gradient, recognises a kink, and shrinks a failing list of
// choices to the smallest one. fuzz_adjoints runs many more programs.
#include <gtest/gtest.h>

#include <functional>
#include <numeric>

#include "gradient/adversary/auto_scheduled.h"
#include "gradient/adversary/check.h"
#include "support/checked_accesses.h"
#include "support/program_counts.h"
#include "support/run_apart.h"

namespace retrograde::gradient {
namespace {

constexpr unsigned programs_per_shard = 15, shards = 16, one_compiled_of = 8;
constexpr unsigned workloads_per_shard = 10, shards_of_workloads = 6;
constexpr unsigned scheduled_per_shard = 5, shards_scheduled = 6;
// 240 programs, 60 workloads, and 30 that the compiler schedules; or a quarter of the shards.
constexpr unsigned step = many_or_few(1, 4);

class Adversary : public ::testing::TestWithParam<unsigned> {};

TEST_P(Adversary, IsRightOrRefused) {
  unsigned checked = 0;
  for (unsigned i = 0; i < programs_per_shard; ++i) {
    const unsigned seed = GetParam() * programs_per_shard + i + 1;
    Choices choices(seed);
    const Judged judged = judge(choices, i % one_compiled_of == 0);
    EXPECT_LT(judged.judgement, Judgement::Wrong)
        << "fuzz_adjoints --seed " << seed << ": " << judged.detail;
    checked += judged.judgement <= Judgement::Kink;  // forward mode agrees with reverse mode
  }
  EXPECT_GT(checked, programs_per_shard / 2);
}

INSTANTIATE_TEST_SUITE_P(Shard, Adversary, ::testing::Range(0u, shards, step));

// Programs in the forms of users' programs; fuzz_adjoints --style workloads runs many more.
class Workloads : public ::testing::TestWithParam<unsigned> {};

TEST_P(Workloads, AreRight) {
  unsigned checked = 0;
  for (unsigned i = 0; i < workloads_per_shard; ++i) {
    const unsigned seed = GetParam() * workloads_per_shard + i + 1;
    Choices choices(seed);
    const Judged judged = judge_workload(choices, i % one_compiled_of == 0, fuzz::Workload::Any);
    EXPECT_LT(judged.judgement, Judgement::Wrong)
        << "fuzz_adjoints --style workloads --seed " << seed << ": " << judged.detail;
    checked += judged.judgement <= Judgement::Kink;
  }
  EXPECT_GE(checked, workloads_per_shard - 2);
}

INSTANTIATE_TEST_SUITE_P(Shard, Workloads, ::testing::Range(0u, shards_of_workloads, step));

// Regressions found under random schedules, by seed: two threads computed into shared memory (4402864), a value was
// read before it was written (4300969), and a value was never computed (4400916).
TEST(AdversaryFindings, ProgramsWhoseMachineCodeWasWrongAreRight) {
  for (const unsigned seed : {4300969u, 4400916u, 4402864u}) {
    for (int run = 0; run < 3; ++run) {
      Choices choices(seed);
      const Judged judged = judge(choices, true);
      EXPECT_LT(judged.judgement, Judgement::Wrong)
          << "fuzz_adjoints --seed " << seed << ": " << judged.detail;
    }
  }
}

Var x("x");

// out(x) = value(image) over an image of `natural_size` equal elements.
Judged judge_of_equal(const std::function<Expr(const Buffer<float>&)>& value, float element) {
  AdversaryProgram p;
  Buffer<float> image(std::vector<int>{natural_size}, "image");
  image.fill(element);
  p.images.push_back(image);
  p.scale.set(1.0f);
  p.runs = {{{{0}, {natural_size}}}};
  Func out("out");
  out(x) = value(image) * p.scale;
  p.outputs = p.funcs = {out};
  return judge(p, 1, false);
}

Judged judge_pointwise(Expr (*value)(const Expr&), float element) {
  return judge_of_equal([&](const Buffer<float>& image) { return value(image(x)); }, element);
}

TEST(AdversaryOracle, AcceptsARightGradient) {
  const auto square = [](const Expr& e) { return e * sin(e); };
  EXPECT_EQ(judge_pointwise(square, 0.5f).judgement, Judgement::Right);
}

TEST(AdversaryOracle, FindsAGradientThatLacksATerm) {
  const auto cut = [](const Expr& e) { return e * stop_gradient(e); };
  EXPECT_EQ(judge_pointwise(cut, 0.5f).judgement, Judgement::Wrong);
}

// The second output lacks a term of its gradient; the first one is right.
TEST(AdversaryOracle, FindsAWrongGradientOfASecondOutput) {
  for (const bool is_wrong : {false, true}) {
    AdversaryProgram p;
    Buffer<float> image(std::vector<int>{natural_size}, "image");
    image.fill(0.5f);
    p.images.push_back(image);
    p.scale.set(1.0f);
    p.runs = {{{{0}, {natural_size}}, {{1}, {2}}}};
    Func first("first"), second("second");
    first(x) = image(x) * p.scale;
    second(x) = image(x) * (is_wrong ? stop_gradient(image(x)) : image(x));
    p.outputs = p.funcs = {first, second};
    EXPECT_EQ(judge(p, 1, false).judgement, is_wrong ? Judgement::Wrong : Judgement::Right);
  }
}

TEST(AdversaryOracle, KnowsAKinkAndAJump) {
  const auto kink = [](const Expr& e) { return max(e, 0.5f); };
  const auto jump = [](const Expr& e) { return select(e > 0.5f, e, 2.0f * e); };
  EXPECT_EQ(judge_pointwise(kink, 0.5f).judgement, Judgement::Kink);
  EXPECT_EQ(judge_pointwise(kink, 0.75f).judgement, Judgement::Right);
  EXPECT_EQ(judge_pointwise(jump, 0.5f).judgement, Judgement::Kink);
}

// Along any direction, the median of equal elements has the same slope on both sides.
TEST(AdversaryOracle, KnowsTheKinkOfAMedian) {
  const auto median = [](const Buffer<float>& image) {
    const Expr a = image(x), b = image((x + 1) % natural_size), c = image((x + 2) % natural_size);
    return max(min(a, b), min(max(a, b), c));
  };
  EXPECT_EQ(judge_of_equal(median, 0.5f).judgement, Judgement::Kink);
}

TEST(AdversaryOracle, PassesOverWhatIsNotFinite) {
  const auto infinite = [](const Expr& e) { return 1.0f / (e - e); };
  EXPECT_EQ(judge_pointwise(infinite, 0.5f).judgement, Judgement::Illegal);
}

TEST(AdversaryChoices, AreReplayedAndContinueWithZeros) {
  Choices drawn(7);
  std::vector<int> first;
  for (int i = 0; i < 20; ++i) first.push_back(drawn.below(100));
  Choices replayed(drawn.taken());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(replayed.below(100), first[static_cast<size_t>(i)]);
  EXPECT_EQ(replayed.below(100), 0);
  EXPECT_FALSE(replayed.chance(99));
}

TEST(AdversaryChoices, ShrinkToTheSmallestListThatFails) {
  std::vector<uint32_t> list(40);
  std::iota(list.begin(), list.end(), 3u);
  const auto has_large_pair = [](const std::vector<uint32_t>& l) {
    return l.size() >= 2 && l[0] >= 5 && l[1] >= 7;
  };
  EXPECT_EQ(fuzz::shrink_choices(list, has_large_pair), (std::vector<uint32_t>{5, 7}));
}

// A sanitizer ends a process with an exit code, which must not be taken for a result.
TEST(RunApart, AProcessThatExitsOnItsOwnIsACrash) {
  for (int code : {0, 1}) {
    const fuzz::ApartResult exited = fuzz::run_apart({}, [&](std::string&) -> int { _exit(code); });
    EXPECT_TRUE(exited.is_crash()) << code;
  }
  const fuzz::ApartResult returned = fuzz::run_apart({}, [](std::string& detail) {
    detail = "seen";
    return 3;
  });
  EXPECT_FALSE(returned.is_crash());
  EXPECT_EQ(returned.code, 3);
  EXPECT_EQ(returned.detail, "seen");
}

// A process that blocks or waits is ended when its time is up.
TEST(RunApart, AProcessThatStandsStillIsEnded) {
  const fuzz::ApartResult still = fuzz::run_apart({.seconds = 1}, [](std::string&) -> int {
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, nullptr);
    while (true) pause();
  });
  EXPECT_TRUE(still.is_slow());
}

// Gradients under the compiler's own schedules; fuzz_schedules runs many more.
class AutoScheduled : public ::testing::TestWithParam<unsigned> {};

TEST_P(AutoScheduled, IsLegalRightAndTheSameForAnyThreads) {
  uint64_t scheduled = 0;
  for (unsigned i = 0; i < scheduled_per_shard; ++i) {
    const unsigned seed = GetParam() * scheduled_per_shard + i + 1;
    Choices choices(seed);
    const Judged judged = judge_auto_scheduled(choices, i == 0);
    EXPECT_LT(judged.judgement, Judgement::Wrong)
        << "fuzz_schedules --seed " << seed << ": " << judged.detail;
    scheduled += judged.judgement == Judgement::Right;
  }
  EXPECT_GT(scheduled, scheduled_per_shard / 2);
}

INSTANTIATE_TEST_SUITE_P(Shard, AutoScheduled, ::testing::Range(0u, shards_scheduled, step));

}  // namespace
}  // namespace retrograde::gradient
