// fuzz_moves -- searches for moves that break an invariant or change what a program computes. Its arguments are those of
// support/fuzz.h.
#include "support/fuzz.h"
#include "support/move_walk.h"

int main(int argc, char** argv) {
  using namespace retrograde;
  const auto judge = [](fuzz::Choices& choices, bool) {
    fuzz::MoveWalk walk(choices);
    walk.run();
    return walk.judge(get_jit_target_from_environment());
  };
  const auto text = [](fuzz::Choices& choices) {
    fuzz::MoveWalk walk(choices);
    walk.run();
    return walk.text();
  };
  return fuzz::fuzz_main({.judge = judge, .text = text, .most_slow = 0.01}, argc, argv);
}
