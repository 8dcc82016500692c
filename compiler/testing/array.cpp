// Element access to host buffers by type, and the comparison.
#include "testing/array.h"

#include <HalideRuntime.h>

#include <cmath>
#include <cstring>
#include <sstream>

#include "diagnostics/error.h"

namespace retrograde::oracle {

using ir::Scalar;

namespace {

template <typename T>
T get(const void* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

template <typename T>
void put(void* at, T value) {
  std::memcpy(at, &value, sizeof(T));
}

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
  std::ostringstream out;
  out.precision(17);
  if (value.type.is_float()) {
    out << value.f;
  } else if (value.type.is_int()) {
    out << value.i;
  } else {
    out << value.u;
  }
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

void Array::copy_to(halide_buffer_t& buffer) const {
  const Region target = region_of(buffer);
  region.for_each([&](const std::vector<int>& point) {
    for (int d = 0; d < target.dimensions(); ++d) {
      if (point[d] < target.mins[d] || point[d] >= target.mins[d] + target.extents[d]) return;
    }
    const Value& value = at(point);
    if (!value.is_undef()) write_element(buffer, point, value.scalar);
  });
}

Type type_of_buffer(const halide_buffer_t& buffer) {
  const int bits = buffer.type.bits;
  switch (buffer.type.code) {
    case halide_type_int:
      return Int(bits);
    case halide_type_uint:
      return UInt(bits);
    case halide_type_float:
      return Float(bits);
    case halide_type_bfloat:
      return BFloat(bits);
    default:
      return Handle();
  }
}

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
  const void* at = address_of(buffer, point);
  if (type.is_float()) {
    if (type.is_bfloat()) {
      return Scalar::of_float(type, double(bfloat16_t::make_from_bits(get<uint16_t>(at))));
    }
    if (type.bits() == 16) {
      return Scalar::of_float(type, double(float16_t::make_from_bits(get<uint16_t>(at))));
    }
    return Scalar::of_float(type, type.bits() == 32 ? get<float>(at) : get<double>(at));
  }
  switch (type.bytes()) {
    case 1:
      return type.is_int() ? Scalar::of_int(type, get<int8_t>(at))
                           : Scalar::of_uint(type, get<uint8_t>(at));
    case 2:
      return type.is_int() ? Scalar::of_int(type, get<int16_t>(at))
                           : Scalar::of_uint(type, get<uint16_t>(at));
    case 4:
      return type.is_int() ? Scalar::of_int(type, get<int32_t>(at))
                           : Scalar::of_uint(type, get<uint32_t>(at));
    default:
      return type.is_int() ? Scalar::of_int(type, get<int64_t>(at))
                           : Scalar::of_uint(type, get<uint64_t>(at));
  }
}

void write_element(halide_buffer_t& buffer, const std::vector<int>& point, const Scalar& value) {
  const Type type = type_of_buffer(buffer);
  void* at = address_of(buffer, point);
  if (type.is_float()) {
    const double x = value.as_double();
    if (type.is_bfloat()) return put(at, bfloat16_t(x).bits);
    if (type.bits() == 16) return put(at, float16_t(x).bits);
    return type.bits() == 32 ? put(at, static_cast<float>(x)) : put(at, x);
  }
  switch (type.bytes()) {
    case 1:
      return put(at, static_cast<uint8_t>(value.u));
    case 2:
      return put(at, static_cast<uint16_t>(value.u));
    case 4:
      return put(at, static_cast<uint32_t>(value.u));
    default:
      return put(at, value.u);
  }
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
