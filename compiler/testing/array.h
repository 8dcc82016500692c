// array.h -- the result of the interpreter: a dense box of values with error bounds, and its comparison with a buffer
// that machine code filled.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "testing/tracked_value.h"

struct halide_buffer_t;

namespace retrograde::oracle {

// A half-open region, dimension 0 first.
struct Region {
  std::vector<int> mins, extents;
  int dimensions() const { return static_cast<int>(mins.size()); }
  size_t points() const;
  // Calls f with every point, dimension 0 fastest.
  void for_each(const std::function<void(const std::vector<int>&)>& f) const;
};

struct Array {
  Type type;
  Region region;
  std::vector<Value> values;  // dimension 0 innermost, dense

  size_t index_of(const std::vector<int>& point) const;
  const Value& at(const std::vector<int>& point) const { return values[index_of(point)]; }
  Value& at(const std::vector<int>& point) { return values[index_of(point)]; }
};

// Reads one element of a host buffer of any type and layout.
ir::Scalar read_element(const halide_buffer_t& buffer, const std::vector<int>& point);
void write_element(halide_buffer_t& buffer, const std::vector<int>& point, const ir::Scalar& value);
Type type_of_buffer(const halide_buffer_t& buffer);
Region region_of(const halide_buffer_t& buffer);

struct Comparison {
  size_t compared = 0, unstable = 0, undefined = 0, mismatches = 0;
  std::string first_mismatch;  // "(3, 4): 5 instead of 6 +- 0"
  bool agrees() const { return mismatches == 0; }
};

// Compares every element of `expected`. An element with error 0 must be equal (NaN equals NaN, -0 equals 0); others may
// differ by slack * error. Unstable and undefined elements are counted, not compared.
Comparison compare(const Array& expected, const halide_buffer_t& actual, double slack = 2);

}  // namespace retrograde::oracle
