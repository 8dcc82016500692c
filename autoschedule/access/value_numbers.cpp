#include "autoschedule/access/value_numbers.h"

#include <algorithm>

namespace retrograde::planning {

IteratorSet Value::depends() const {
  IteratorSet result = 0;
  for (const int16_t i : iterators) result |= set_of(i);
  return result;
}

std::vector<const Value*> pointers_to(const std::vector<Value>& values) {
  return ir::mapped(values, [](const Value& v) { return &v; });
}

size_t ValueNumbers::Hash::operator()(const Words& words) const {
  uint64_t result = words.size();
  for (const uint64_t word : words) {
    result = (result ^ word) * 0x9e3779b97f4a7c15u;
    result ^= result >> 29;
  }
  return result;
}

// The key holds, for each operand, its number and the positions of its iterators among those of the result.
Value ValueNumbers::combine(Words what, const std::vector<const Value*>& operands) {
  Value result;
  for (const Value* operand : operands) {
    result.from_data |= operand->from_data;
    what.push_back(operand->number);
    for (const int16_t i : operand->iterators) {
      auto place = std::ranges::find(result.iterators, i);
      if (place == result.iterators.end()) {
        result.iterators.push_back(i);
        place = result.iterators.end() - 1;
      }
      what.push_back(static_cast<uint64_t>(place - result.iterators.begin()));
    }
  }
  const auto [entry, is_new] = known_.try_emplace(std::move(what), last_ + 1);
  if (is_new) ++last_;
  result.number = entry->second;
  return result;
}

uint64_t ValueNumbers::word_of(const std::string& name) {
  return names_.try_emplace(name, names_.size()).first->second;
}

}  // namespace retrograde::planning
