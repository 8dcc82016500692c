// elements.h -- elements of the types of HalideRuntime.h as C++ values.
#pragma once

#include <HalideBuffer.h>
#include <HalideRuntime.h>

#include <cstdint>
#include <string>
#include <type_traits>

#include "run_gen/options.h"

namespace retrograde::run_gen {

using Image = Halide::Runtime::Buffer<void>;

// "uint8", "float32", "bool", "handle"
std::string type_name(halide_type_t type);

// Calls f(T{}) with the C++ type of these elements. Throws Problem for 16-bit floats and handles.
template <typename F>
void with_type(halide_type_t type, F&& f) {
  const auto is = [&](halide_type_code_t code, int bits) {
    return type.code == code && type.bits == bits;
  };
  if (is(halide_type_uint, 1)) return f(bool{});
  if (is(halide_type_int, 8)) return f(int8_t{});
  if (is(halide_type_int, 16)) return f(int16_t{});
  if (is(halide_type_int, 32)) return f(int32_t{});
  if (is(halide_type_int, 64)) return f(int64_t{});
  if (is(halide_type_uint, 8)) return f(uint8_t{});
  if (is(halide_type_uint, 16)) return f(uint16_t{});
  if (is(halide_type_uint, 32)) return f(uint32_t{});
  if (is(halide_type_uint, 64)) return f(uint64_t{});
  if (is(halide_type_float, 32)) return f(float{});
  if (is(halide_type_float, 64)) return f(double{});
  throw Problem("values of type " + type_name(type) + " are not supported");
}

// Parses the whole text as a value of the type. Throws Problem if that fails.
halide_scalar_value_t read_scalar(halide_type_t type, const std::string& text);

}  // namespace retrograde::run_gen
