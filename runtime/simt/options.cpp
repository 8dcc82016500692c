#include "simt/options.h"

#include <cstdlib>
#include <cstring>

#include "simt/state.h"

namespace retrograde::simt {
namespace {

const char* text_of(const char* name) {
  const char* text = std::getenv(name);
  return text && *text ? text : nullptr;
}

uint64_t number_of(const char* name, uint64_t otherwise) {
  const char* text = text_of(name);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

int32_t order_of_environment() {
  constexpr const char* names[] = {"forward", "reverse", "random", "warp_ahead"};
  const char* text = text_of("RETROGRADE_SIMT_ORDER");
  for (int32_t i = 0; text && i < 4; i++) {
    if (std::strcmp(text, names[i]) == 0) return i;
  }
  return retrograde_simt_forward;
}

retrograde_simt_options from_environment() {
  retrograde_simt_options given = {};
  given.order = order_of_environment();
  given.seed = number_of("RETROGRADE_SIMT_SEED", 1);
  given.devices = static_cast<int32_t>(number_of("RETROGRADE_SIMT_DEVICES", 1));
  given.memory_bytes = number_of("RETROGRADE_SIMT_MEMORY", uint64_t{1} << 30);
  given.find_races = number_of("RETROGRADE_SIMT_RACES", 1) != 0;
  given.profile = number_of("RETROGRADE_SIMT_PROFILE", 0) != 0;
  given.in_order = number_of("RETROGRADE_SIMT_IN_ORDER", 0) != 0;
  return given;
}

}  // namespace

retrograde_simt_options& options() {
  static retrograde_simt_options given = from_environment();
  return given;
}

}  // namespace retrograde::simt

void retrograde_simt_get_options(retrograde_simt_options* out) {
  const std::lock_guard lock(retrograde::simt::driver_mutex());
  *out = retrograde::simt::options();
}
void retrograde_simt_set_options(const retrograde_simt_options* in) {
  const std::lock_guard lock(retrograde::simt::driver_mutex());
  retrograde::simt::options() = *in;
}
