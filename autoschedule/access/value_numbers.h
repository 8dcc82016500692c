// value_numbers.h -- numbers for values: two expressions with one number are equal up to the names of the iterators that
// they depend on.
//
//   i(x, y) + 1    and    i(r.x, r.y) + 1    have one number; the first depends on (x, y), the second on (r.x, r.y)
//   i(y, x) + 1    has the same number and depends on (y, x)
//   i(x, x) + 1    has another one
//
// So a gather and the scatter that is its adjoint have one place, although they run in different loops. Two values of
// one stage are equal where numbers and iterators agree.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "graph/function.h"

namespace retrograde::planning {

using namespace graph;

// A set of iterators of a stage: bit i stands for iterator i, the last bit for all from there on.
using IteratorSet = uint32_t;
inline IteratorSet set_of(int iterator) {
  constexpr int last = std::numeric_limits<IteratorSet>::digits - 1;
  return IteratorSet{1} << (iterator < last ? iterator : last);
}

struct Value {
  uint32_t number = 0;             // 0: none
  bool from_data = false;          // it reads memory
  std::vector<int16_t> iterators;  // that it depends on, in the order of their first use

  bool defined() const { return number != 0; }
  IteratorSet depends() const;
  bool operator==(const Value& other) const {
    return number == other.number && iterators == other.iterators;
  }
  auto operator<=>(const Value& other) const {
    return number != other.number ? number <=> other.number : iterators <=> other.iterators;
  }
};

std::vector<const Value*> pointers_to(const std::vector<Value>& values);

// The first word of a key that is no expression's; those of expressions start with their kind, which is smaller.
inline constexpr uint64_t form_key = 1000, place_key = 1001, composed_key = 1002;

class ValueNumbers {
 public:
  using Words = std::vector<uint64_t>;

  static Value iterator(int index) { return {1, false, {static_cast<int16_t>(index)}}; }
  // The result of an operation, which `what` describes completely, on its operands.
  Value combine(Words what, const std::vector<const Value*>& operands);
  // A value that equals no other one.
  uint32_t fresh() { return ++last_; }
  // The number of a name.
  uint64_t word_of(const std::string& name);

 private:
  struct Hash {
    size_t operator()(const Words& words) const;
  };
  std::unordered_map<Words, uint32_t, Hash> known_;
  std::unordered_map<std::string, uint64_t> names_;
  uint32_t last_ = 1;  // 1: an iterator
};

}  // namespace retrograde::planning
