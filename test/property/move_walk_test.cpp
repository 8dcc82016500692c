// Random moves on random programs. test/property/fuzz_moves.cpp runs any others, and shrinks what it finds.
#include <gtest/gtest.h>

#include <iostream>

#include "support/move_walk.h"
#include "support/program_counts.h"

namespace retrograde::fuzz {
namespace {

constexpr uint64_t walks = many_or_few(2000, 100);

TEST(MoveWalks, GivePlansThatComputeTheSame) {
  std::map<std::string, uint64_t> moves;
  uint64_t illegal = 0;
  for (uint64_t seed = 1; seed <= walks; ++seed) {
    try {
      Choices choices(seed);
      MoveWalk walk(choices);
      walk.run();
      const Judged judged = walk.judge(get_jit_target_from_environment());
      for (const auto& [name, count] : judged.counts) moves[name] += count;
      illegal += judged.judgement == Judgement::Illegal;
      EXPECT_TRUE(judged.judgement == Judgement::Right || judged.judgement == Judgement::Illegal)
          << "seed " << seed << ": " << judged.detail << "\n"
          << walk.text() << "Shrink it: fuzz_moves --seed " << seed;
    } catch (const UserError&) {
      ++illegal;  // the program
    }
  }
  EXPECT_LT(illegal, walks / 4);
  for (const planning::Move& move : planning::all_moves()) {
    EXPECT_GT(moves[move.name], 0u) << move.name;
    std::cout << move.name << " " << moves[move.name] << "\n";
  }
}

}  // namespace
}  // namespace retrograde::fuzz
