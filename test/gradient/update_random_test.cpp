// Tests random updates of small Funcs that read and overwrite themselves at random indices, affine or data-dependent.
// An accepted program must have a right gradient, whether values may be kept or not, according to the oracle of
// adversary/check.h.
#include <gtest/gtest.h>

#include <cmath>

#include "diagnostics/error.h"
#include "gradient/adversary/check.h"
#include "gradient/adversary/probe.h"
#include "support/program_counts.h"

namespace retrograde::gradient {
namespace {

constexpr unsigned programs = many_or_few(300, 150);

AdversaryProgram program_of(unsigned seed, const AdjointOptions& options) {
  Choices choices(seed);
  return {fuzz::make_program(choices, fuzz::Style::updates()), options, true, {}};
}

// The number of programs with each judgement.
std::map<Judgement, unsigned> judge_all(unsigned count, const AdjointOptions& options) {
  std::map<Judgement, unsigned> judged;
  for (unsigned seed = 0; seed < count && !::testing::Test::HasFailure(); ++seed) {
    const AdversaryProgram program = program_of(seed, options);
    const Judged result = judge(program, seed, false);
    EXPECT_LT(result.judgement, Judgement::Wrong)
        << "seed " << seed << ": " << result.detail << "\n"
        << to_text(program);
    ++judged[result.judgement];
  }
  return judged;
}

TEST(RandomUpdates, AreRightWhenValuesAreKeptWithinABudget) {
  constexpr unsigned count = programs / 3;
  auto judged = judge_all(count, {});
  EXPECT_EQ(judged[Judgement::Refused], 0u);
  EXPECT_GT(2 * judged[Judgement::Right], count);
}

TEST(RandomUpdates, AreRightWhenValuesMayBeKept) {
  constexpr unsigned count = programs / 2;
  auto judged = judge_all(count, {.overwritten = Overwritten::Store});
  EXPECT_EQ(judged[Judgement::Refused], 0u);
  EXPECT_GT(2 * judged[Judgement::Right], count);
}

// Most of the programs overwrite values that a partial needs, so Overwritten::Refuse must refuse them.
TEST(RandomUpdates, AreRightOrRefusedWhenValuesMayNotBeKept) {
  auto judged = judge_all(programs, {.overwritten = Overwritten::Refuse});
  EXPECT_LE(10 * judged[Judgement::Refused], 6 * programs);
  EXPECT_GT(judged[Judgement::Refused], 0u);
}

// The same products are added in another order.
TEST(RandomUpdates, AreTheSameWithABudgetForStates) {
  constexpr unsigned count = programs / 2;
  unsigned compared = 0;
  for (unsigned seed = 0; seed < count; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const AdversaryProgram p = program_of(seed, {});
    Weights weights(seed);
    std::vector<Buffer<float>> w;
    for (int k = 0; k < p.output().outputs(); ++k) w.push_back(weights.over(p.region(), "w"));
    const SeededOutput seeded{p.output(), p.region(), w, reading(w, "w")};
    const auto gradient = [&](std::optional<int> states) {
      const Derivative d = propagate_adjoints(
          seeded.output, seeded.seed, seeded.bounds(),
          {.overwritten = Overwritten::Store, .wrt = {p.image(0)}, .checkpoint_states = states});
      const Func by_image = d.of(p.image(0));
      return by_image.defined()
                 ? evaluate(by_image, oracle::region_of(*p.images[0].raw_buffer()))[0].values
                 : std::vector<oracle::Value>();
    };
    const auto expected = gradient({}), found = gradient(1 + static_cast<int>(seed % 3));
    double scale = 1;
    for (const oracle::Value& v : expected) scale += std::abs(v.scalar.as_double());
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < expected.size() && std::isfinite(scale); ++i)
      ASSERT_NEAR(found[i].scalar.as_double(), expected[i].scalar.as_double(), 1e-12 * scale);
    compared += std::isfinite(scale);
  }
  EXPECT_GT(2 * compared, count);
}

}  // namespace
}  // namespace retrograde::gradient
