#include "simplify/constant_range.h"

#include <algorithm>

#include "ir/scalar.h"
#include "ir/sum.h"

namespace retrograde::simplification {

int64_t saturate(__int128 value) {
  return value > INT64_MAX   ? INT64_MAX
         : value < INT64_MIN ? INT64_MIN
                             : static_cast<int64_t>(value);
}

namespace {

bool is_infinite(int64_t value) { return value == INT64_MAX || value == INT64_MIN; }

// Uses 0 * infinity = 0.
int64_t multiply_ends(int64_t a, int64_t b) {
  if (a == 0 || b == 0) return 0;
  if (is_infinite(a) || is_infinite(b)) return (a < 0) == (b < 0) ? INT64_MAX : INT64_MIN;
  return saturate(__int128{a} * b);
}

int64_t divide_ends(int64_t a, int64_t b) { return is_infinite(a) ? a : euclidean_div(a, b); }

}  // namespace

int64_t add_ends(int64_t a, int64_t b) {
  if (is_infinite(a)) return a;
  return is_infinite(b) ? b : saturate(__int128{a} + b);
}

ConstantRange range_of(Type type) {
  return type.is_int_or_uint() ? ConstantRange{type.min_int(), type.max_int()} : ConstantRange();
}

ConstantRange operator+(const ConstantRange& a, const ConstantRange& b) {
  return {add_ends(a.min, b.min), add_ends(a.max, b.max)};
}
ConstantRange operator*(const ConstantRange& a, int64_t factor) {
  const int64_t x = multiply_ends(a.min, factor), y = multiply_ends(a.max, factor);
  return {std::min(x, y), std::max(x, y)};
}

ConstantRange multiply(const ConstantRange& a, const ConstantRange& b) {
  return hull(a * b.min, a * b.max);
}

// Division by b > 0 rounds down and is monotonic in each operand, so the corners suffice. Otherwise
// only |a / b| <= |a| is used.
ConstantRange divide(const ConstantRange& a, const ConstantRange& b) {
  if (b.min > 0) {
    const int64_t high = b.max == infinity ? infinity : b.max;
    const auto far = [&](int64_t end) {
      return end < 0 ? -1 : 0;
    };  // the limit for an unbounded divisor
    const int64_t corners[] = {divide_ends(a.min, b.min), divide_ends(a.max, b.min),
                               high == infinity ? far(a.min) : divide_ends(a.min, high),
                               high == infinity ? far(a.max) : divide_ends(a.max, high)};
    return {*std::min_element(corners, corners + 4), *std::max_element(corners, corners + 4)};
  }
  if (is_infinite(a.min) || is_infinite(a.max)) return {};
  const int64_t largest = std::max(std::abs(a.min), std::abs(a.max));
  return {-largest, largest};
}

ConstantRange modulo(const ConstantRange& a, const ConstantRange& b) {
  if (b.min > 0 && a.min >= 0 && a.max < b.min) return a;
  if (is_infinite(b.min) || is_infinite(b.max)) return {0, a.min >= 0 ? a.max : infinity};
  const int64_t largest = std::max<int64_t>({std::abs(b.min), std::abs(b.max), 1}) - 1;
  return {0, a.min >= 0 ? std::min(largest, a.max) : largest};
}

ConstantRange wrapped(const ConstantRange& r, Type type) {
  const ConstantRange all_values = range_of(type);
  if (is_index_type(type)) return intersection(r, all_values);  // does not overflow
  // The largest uint64 exceeds int64, so the type's range has no upper end, and sums may wrap.
  if (type.is_uint() && type.bits() == 64 && r.max == infinity) return all_values;
  return r.is_within(all_values) ? r : all_values;
}

}  // namespace retrograde::simplification
