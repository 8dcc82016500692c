#include "run_gen/elements.h"

#include <charconv>
#include <cstring>

namespace retrograde::run_gen {

std::string type_name(halide_type_t type) {
  if (type.code == halide_type_handle) return "handle";
  if (type.bits == 1) return "bool";
  const char* kind = type.code == halide_type_int     ? "int"
                     : type.code == halide_type_uint  ? "uint"
                     : type.code == halide_type_float ? "float"
                                                      : "bfloat";
  return kind + std::to_string(type.bits);
}

namespace {

template <typename T>
bool read(const std::string& text, T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    value = text == "true" || text == "1";
    return value || text == "false" || text == "0";
  } else {
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end;
  }
}

}  // namespace

halide_scalar_value_t read_scalar(halide_type_t type, const std::string& text) {
  halide_scalar_value_t result = {};
  with_type(type, [&](auto value) {
    if (!read(text, value))
      throw Problem("\"" + text + "\" is not a value of type " + type_name(type));
    std::memcpy(static_cast<void*>(&result), &value, sizeof value);
  });
  return result;
}

}  // namespace retrograde::run_gen
