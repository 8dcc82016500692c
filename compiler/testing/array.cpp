// Access to elements of host buffers by type, and the comparison of arrays with buffers.
#include "testing/array.h"

#include <HalideRuntime.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <sstream>

#include "diagnostics/error.h"
#include "frontend/data/buffer.h"

namespace retrograde::oracle {

using ir::Scalar;

namespace {

uint8_t* address_of(const halide_buffer_t& buffer, const std::vector<int>& point) {
  int64_t offset = 0;
  for (int d = 0; d < buffer.dimensions; ++d) {
    offset += static_cast<int64_t>(point[d] - buffer.dim[d].min) * buffer.dim[d].stride;
  }
  return buffer.host + offset * buffer.type.bytes();
}

bool matches(const Value& expected, const Scalar& actual, double slack) {
  const Scalar& want = expected.scalar;
  if (!want.type.is_float()) return want.u == actual.u;
  if (std::isnan(want.f) || std::isnan(actual.f)) return std::isnan(want.f) && std::isnan(actual.f);
  if (want.f == actual.f) return true;
  return std::fabs(want.f - actual.f) <= slack * expected.error;
}

std::string show(const Scalar& value) {
  if (!value.type.is_float())
    return value.type.is_int() ? std::to_string(value.i) : std::to_string(value.u);
  std::ostringstream out;
  out.precision(17);
  out << value.f;
  return out.str();
}

std::string describe(const std::vector<int>& point, const Value& expected, const Scalar& actual) {
  std::ostringstream out;
  out << "(";
  for (size_t d = 0; d < point.size(); ++d) out << (d ? ", " : "") << point[d];
  out << "): " << show(actual) << " instead of " << show(expected.scalar) << " +- "
      << expected.error;
  return out.str();
}

}  // namespace

size_t Region::points() const {
  size_t count = 1;
  for (const int extent : extents) count *= extent > 0 ? extent : 0;
  return count;
}

void Region::for_each(const std::function<void(const std::vector<int>&)>& f) const {
  if (points() == 0) return;
  std::vector<int> point = mins;
  while (true) {
    f(point);
    size_t d = 0;
    for (; d < point.size(); ++d) {
      if (++point[d] < mins[d] + extents[d]) break;
      point[d] = mins[d];
    }
    if (d == point.size()) return;
  }
}

size_t Array::index_of(const std::vector<int>& point) const {
  size_t index = 0, stride = 1;
  for (int d = 0; d < region.dimensions(); ++d) {
    index += (point[d] - region.mins[d]) * stride;
    stride *= region.extents[d];
  }
  return index;
}

Type type_of_buffer(const halide_buffer_t& buffer) { return from_halide_type(buffer.type); }

Region region_of(const halide_buffer_t& buffer) {
  Region region;
  for (int d = 0; d < buffer.dimensions; ++d) {
    region.mins.push_back(buffer.dim[d].min);
    region.extents.push_back(buffer.dim[d].extent);
  }
  return region;
}

Scalar read_element(const halide_buffer_t& buffer, const std::vector<int>& point) {
  const Type type = type_of_buffer(buffer);
  uint64_t bits = 0;
  std::memcpy(&bits, address_of(buffer, point), static_cast<size_t>(type.bytes()));
  if (type.is_bfloat())
    return Scalar::of_float(type, double(bfloat16_t::make_from_bits(static_cast<uint16_t>(bits))));
  if (type.is_float() && type.bits() == 16)
    return Scalar::of_float(type, double(float16_t::make_from_bits(static_cast<uint16_t>(bits))));
  if (type.is_float() && type.bits() == 32)
    return Scalar::of_float(type, std::bit_cast<float>(static_cast<uint32_t>(bits)));
  if (type.is_float()) return Scalar::of_float(type, std::bit_cast<double>(bits));
  const int unused = 64 - 8 * type.bytes();
  return type.is_int() ? Scalar::of_int(type, static_cast<int64_t>(bits << unused) >> unused)
                       : Scalar::of_uint(type, bits);
}

void write_element(halide_buffer_t& buffer, const std::vector<int>& point, const Scalar& value) {
  const Type type = type_of_buffer(buffer);
  uint64_t bits = value.u;
  if (type.is_float()) {
    const double x = value.as_double();
    bits = type.is_bfloat()    ? bfloat16_t(x).bits
           : type.bits() == 16 ? float16_t(x).bits
           : type.bits() == 32 ? std::bit_cast<uint32_t>(static_cast<float>(x))
                               : std::bit_cast<uint64_t>(x);
  }
  std::memcpy(address_of(buffer, point), &bits, static_cast<size_t>(type.bytes()));
}

Comparison compare(const Array& expected, const halide_buffer_t& actual, double slack) {
  Comparison result;
  expected.region.for_each([&](const std::vector<int>& point) {
    const Value& value = expected.at(point);
    if (value.is_undef()) {
      ++result.undefined;
    } else if (!value.is_stable()) {
      ++result.unstable;
    } else {
      ++result.compared;
      const Scalar got = read_element(actual, point);
      if (matches(value, got, slack)) return;
      if (result.mismatches++ == 0) result.first_mismatch = describe(point, value, got);
    }
  });
  return result;
}

}  // namespace retrograde::oracle
