// random_sequence.h -- selects the random numbers that a program draws.
//
// A random number depends on its seed, on the Func and stage that draw it, and on the point. A call
// without a seed gets a stream number instead. Funcs are distinguished by their names, and Funcs of
// one name by the order in which they draw. Both are counted as the program is constructed, so a
// program that is constructed again in a fresh RandomSequence draws the same numbers.
#pragma once

#include <cstdint>
#include <string>

namespace retrograde::graph {

int32_t next_random_stream();
// The tag of the Func with this unique name.
int32_t random_tag(const std::string& func);

struct RandomState;

// Restarts the counts during its lifetime, and then restores the earlier ones.
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
