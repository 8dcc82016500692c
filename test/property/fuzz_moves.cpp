// fuzz_moves -- searches for moves that break an invariant or change what a program computes. Its arguments are those of
// support/fuzz.h and
//
//   --steps N        the most moves of a walk; 8
//   --prefer MOVE    take this move half of the times it is possible
#include <charconv>

#include "support/fuzz.h"
#include "support/move_walk.h"

int main(int argc, char** argv) {
  using namespace retrograde;
  fuzz::WalkOptions options;
  const auto judge = [&](fuzz::Choices& choices, bool) {
    fuzz::MoveWalk walk(choices, options);
    walk.run();
    return walk.judge(get_jit_target_from_environment());
  };
  const auto text = [&](fuzz::Choices& choices) {
    fuzz::MoveWalk walk(choices, options);
    walk.run();
    return walk.text();
  };
  const auto take = [&](fuzz::Fuzzer&, const std::string& name, const std::string& value) {
    if (name == "--steps") {
      const auto [end, error] =
          std::from_chars(value.data(), value.data() + value.size(), options.most_steps);
      return error == std::errc() && end == value.data() + value.size() && options.most_steps > 0;
    }
    if (name == "--prefer") options.preferred = value;
    return name == "--prefer" && planning::find_move(value) != nullptr;
  };
  return fuzz::fuzz_main({.judge = judge, .text = text, .most_slow = 0.01, .take = take}, argc,
                         argv);
}
