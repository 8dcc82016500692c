// host.h -- Halide's helpers for files, environment, text and numbers.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "diagnostics/error.h"

namespace retrograde::porting {

// ---- files; failures throw CompileError ----
bool file_exists(const std::string& name);
void assert_file_exists(const std::string& name);
void assert_no_file_exists(const std::string& name);
void ensure_no_file_exists(const std::string& name);  // removes the file if it exists
void file_unlink(const std::string& name);
void dir_rmdir(const std::string& name);
// Creates an empty one.
std::string file_make_temp(const std::string& prefix, const std::string& suffix);
std::string dir_make_temp();
std::vector<char> read_entire_file(const std::string& name);
void write_entire_file(const std::string& name, const void* data, size_t bytes);
inline void write_entire_file(const std::string& name, const std::vector<char>& data) {
  write_entire_file(name, data.data(), data.size());
}

// ---- environment ----
std::string get_env_variable(const char* name);  // empty when unset
int get_llvm_version();                          // 191 for 19.1

// ---- text ----
bool starts_with(const std::string& text, const std::string& prefix);
bool ends_with(const std::string& text, const std::string& suffix);
std::string replace_all(const std::string& text, const std::string& find,
                        const std::string& replacement);
std::vector<std::string> split_string(const std::string& text, const std::string& delimiter);
template <typename List>
std::string join_strings(const List& list, const std::string& delimiter) {
  std::string joined;
  bool first = true;
  for (const auto& part : list) {
    if (!first) joined += delimiter;
    joined += part;
    first = false;
  }
  return joined;
}

// ---- numbers ----

// Division rounds so that the remainder is never negative; by 0 both are 0, like / and % of Exprs.
template <typename T>
requires std::is_integral_v<T> T mod_imp(T a, T b) {
  if (b == 0) return 0;
  if constexpr (std::is_unsigned_v<T>) {
    return a % b;
  } else {
    const T rest = b == T(-1) ? T(0) : T(a % b);
    return rest < 0 ? T(rest + (b < 0 ? -b : b)) : rest;
  }
}
template <typename T>
requires std::is_integral_v<T> T div_imp(T a, T b) {
  if (b == 0) return 0;
  using Wrapping = std::make_unsigned_t<T>;
  const T rest = mod_imp(a, b);
  if (std::is_signed_v<T> && b == T(-1)) return static_cast<T>(Wrapping(0) - Wrapping(a));
  return static_cast<T>(static_cast<T>(Wrapping(a) - Wrapping(rest)) / b);
}
int64_t gcd(int64_t a, int64_t b);
int64_t lcm(int64_t a, int64_t b);
// Whether the result overflows an integer of that many bits.
bool add_would_overflow(int bits, int64_t a, int64_t b);
bool sub_would_overflow(int bits, int64_t a, int64_t b);
bool mul_would_overflow(int bits, int64_t a, int64_t b);

// A conversion of numbers that is defined for every value: integers wrap; floats are truncated and
// clamped to the range of the integer; NaN gives 0.
template <typename To, typename From>
To safe_numeric_cast(From value) {
  if constexpr (std::is_floating_point_v<From> && std::is_integral_v<To>) {
    if (value != value) return 0;
    if (value <= static_cast<From>(std::numeric_limits<To>::min()))
      return std::numeric_limits<To>::min();
    if (value >= static_cast<From>(std::numeric_limits<To>::max()))
      return std::numeric_limits<To>::max();
  }
  return static_cast<To>(value);
}

// Compilation provides a large stack itself, so this calls f directly.
template <typename F>
auto run_with_large_stack(const F& f) {
  return f();
}

}  // namespace retrograde::porting
