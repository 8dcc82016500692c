// Checkpoint schedules (revolve): run on a model of the loop that checks every action, and counted
// against the optimum found by dynamic programming without the closed form.
#include "autodiff/time/revolve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace retrograde::autodiff {
namespace {

using Kind = RevolveAction::Kind;

// Runs the actions; returns the number of advances, or -1 when an action is illegal.
int64_t run(int steps, int states) {
  int current = 0, next_reversal = steps - 1;
  int64_t advances = 0;
  std::vector<int> slots(static_cast<size_t>(states), -1);
  for (const RevolveAction& a : revolve_schedule(steps, states)) {
    bool has_slot = a.kind == Kind::Store || a.kind == Kind::Restore;
    if (has_slot && (a.slot < 0 || a.slot >= states)) return -1;
    if (a.kind != Kind::Restore && current != a.step) return -1;
    switch (a.kind) {
      case Kind::Store:
        slots[static_cast<size_t>(a.slot)] = current;
        break;
      case Kind::Restore:
        current = slots[static_cast<size_t>(a.slot)];
        if (current != a.step) return -1;
        break;
      case Kind::Advance:
        ++current, ++advances;
        break;
      case Kind::Reverse:
        if (a.step != next_reversal--) return -1;
        current = -1;
        break;
    }
  }
  return next_reversal == -1 ? advances : -1;
}

// min over m of m + best(m, s) + best(n - m, s - 1); with one state, n (n - 1) / 2.
int64_t best(int n, int s) {
  static std::map<std::pair<int, int>, int64_t> known;
  if (n == 1) return 0;
  if (s == 1) return int64_t{n} * (n - 1) / 2;
  auto [it, is_new] = known.try_emplace({n, s}, -1);
  if (!is_new) return it->second;
  int64_t least = int64_t{n} * n;
  for (int m = 1; m < n; ++m) least = std::min(least, m + best(m, s) + best(n - m, s - 1));
  return known[{n, s}] = least;
}

TEST(Revolve, EverySmallScheduleIsPossibleAndOptimal) {
  for (int n = 1; n <= 60; ++n) {
    for (int s = 1; s <= 12; ++s) {
      EXPECT_EQ(run(n, s), best(n, s)) << n << " steps, " << s << " states";
      EXPECT_EQ(revolve_advances(n, s), best(n, s)) << n << " steps, " << s << " states";
    }
  }
}

TEST(Revolve, LongLoopsReachTheBinomialBound) {
  for (auto [n, s] : {std::pair(1000, 1), {1000, 3}, {1000, 1000}, {10000, 8}, {100000, 40}})
    EXPECT_EQ(run(n, s), revolve_advances(n, s)) << n << " steps, " << s << " states";
  // C(8 + 4, 4) = 495 steps: each runs 4 times, but for those that fewer suffice.
  EXPECT_EQ(revolve_advances(495, 8), 4 * 495 - 220);
}

TEST(Revolve, WithRoomForAllStatesNothingButTheFirstRunIsComputed) {
  EXPECT_EQ(run(50, 50), 49);
  EXPECT_EQ(run(50, 500), 49);
}

TEST(Revolve, MillionsOfStatesNeedNoDeepStack) { EXPECT_EQ(run(2000000, 2000000), 1999999); }

}  // namespace
}  // namespace retrograde::autodiff
