#include "graph/definitions/random_sequence.h"

#include <mutex>
#include <unordered_map>
#include <utility>

#include "graph/names.h"

namespace retrograde::graph {

struct RandomState {
  int32_t streams = 0;
  std::unordered_map<std::string, int>
      same_names;                                 // how many Funcs of each name draw random numbers
  std::unordered_map<std::string, int32_t> tags;  // by unique name
};

namespace {

// The sequence in use.
struct Current {
  std::mutex mutex;
  RandomState* state = new RandomState;  // the first one lives as long as the process
};
Current& current() {
  static Current current;
  return current;
}

RandomState* exchange(RandomState* state) {
  const std::lock_guard lock(current().mutex);
  return std::exchange(current().state, state);
}

// The FNV-1a hash.
int32_t hash_of(const std::string& text) {
  uint32_t hash = 2166136261u;
  for (const unsigned char c : text) hash = (hash ^ c) * 16777619u;
  return static_cast<int32_t>(hash);
}

}  // namespace

RandomSequence::RandomSequence() : before_(exchange(new RandomState)) {}
RandomSequence::~RandomSequence() { delete exchange(before_); }

int32_t next_random_stream() {
  const std::lock_guard lock(current().mutex);
  return current().state->streams++;
}

int32_t random_tag(const std::string& func) {
  const std::lock_guard lock(current().mutex);
  RandomState& state = *current().state;
  const auto known = state.tags.find(func);
  if (known != state.tags.end()) return known->second;
  const std::string name = without_numbers(func);
  const int count = state.same_names[name]++;
  const int32_t tag = hash_of(count == 0 ? name : name + "$" + std::to_string(count));
  return state.tags[func] = tag;
}

}  // namespace retrograde::graph
