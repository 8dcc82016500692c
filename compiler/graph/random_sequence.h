// random_sequence.h -- which random numbers a program draws.
//
// A number depends on its seed, on the Func and stage that draw it, and on the point. A call without
// a seed has a stream number for one; Funcs are told apart by their names, those of one name by the
// order in which they draw. Both are counted as the program is written, so that a program that is
// built again in a sequence of its own draws the same numbers.
#pragma once

#include <cstdint>
#include <string>

namespace retrograde::graph {

int32_t next_random_stream();
// The tag of the Func with this name, which is unique in the process.
int32_t random_tag(const std::string& func);

struct RandomState;

// Counts from the start while it lives, and then goes on where it was.
class RandomSequence {
 public:
  RandomSequence();
  ~RandomSequence();
  RandomSequence(const RandomSequence&) = delete;
  RandomSequence& operator=(const RandomSequence&) = delete;

 private:
  RandomState* const before_;
};

}  // namespace retrograde::graph
