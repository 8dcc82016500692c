// Symbols of the process and of shared libraries by HalideRuntime.h; 16-bit floats as bits.
#include <dlfcn.h>

#include <atomic>
#include <bit>
#include <cmath>

#include "halide/weak.h"

namespace {
std::atomic<halide_get_symbol_t> get_symbol{halide_default_get_symbol};
std::atomic<halide_load_library_t> load_library{halide_default_load_library};
std::atomic<halide_get_library_symbol_t> get_library_symbol{halide_default_get_library_symbol};
}  // namespace

RETROGRADE_WEAK void* halide_default_get_symbol(const char* name) {
  return dlsym(RTLD_DEFAULT, name);
}
RETROGRADE_WEAK void* halide_default_load_library(const char* name) {
  return dlopen(name, RTLD_LAZY);
}
RETROGRADE_WEAK void* halide_default_get_library_symbol(void* library, const char* name) {
  return dlsym(library ? library : RTLD_DEFAULT, name);
}

RETROGRADE_WEAK void* halide_get_symbol(const char* name) { return get_symbol.load()(name); }
RETROGRADE_WEAK void* halide_load_library(const char* name) { return load_library.load()(name); }
RETROGRADE_WEAK void* halide_get_library_symbol(void* library, const char* name) {
  return get_library_symbol.load()(library, name);
}
RETROGRADE_WEAK halide_get_symbol_t halide_set_custom_get_symbol(halide_get_symbol_t handler) {
  return get_symbol.exchange(handler ? handler : halide_default_get_symbol);
}
RETROGRADE_WEAK halide_load_library_t
halide_set_custom_load_library(halide_load_library_t handler) {
  return load_library.exchange(handler ? handler : halide_default_load_library);
}
RETROGRADE_WEAK halide_get_library_symbol_t
halide_set_custom_get_library_symbol(halide_get_library_symbol_t handler) {
  return get_library_symbol.exchange(handler ? handler : halide_default_get_library_symbol);
}

// IEEE binary16: sign, 5 bits of exponent with bias 15, 10 bits of mantissa.
RETROGRADE_WEAK double halide_float16_bits_to_double(uint16_t bits) {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  const double sign = bits >> 15 ? -1.0 : 1.0;
  if (exponent == 31) return mantissa ? std::nan("") : sign * HUGE_VAL;
  if (exponent == 0) return sign * std::ldexp(mantissa, -24);
  return sign * std::ldexp(1024 + mantissa, exponent - 25);
}
RETROGRADE_WEAK float halide_float16_bits_to_float(uint16_t bits) {
  return static_cast<float>(halide_float16_bits_to_double(bits));
}
