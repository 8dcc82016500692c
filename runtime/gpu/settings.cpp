// Process-wide settings for devices.
#include <atomic>
#include <cstdlib>

#include "gpu/host.h"

namespace retrograde::runtime {
namespace {

constexpr int unset = -2;
std::atomic<int> device{unset};
std::atomic<bool> reuses{true};

int device_of_environment() {
  const char* text = std::getenv("HL_GPU_DEVICE");
  return text && *text ? static_cast<int>(std::strtol(text, nullptr, 10)) : -1;
}

}  // namespace

bool reuses_device_memory() { return reuses.load(); }
void set_reuses_device_memory(bool reuse) { reuses = reuse; }

int chosen_device() {
  const int chosen = device.load();
  return chosen == unset ? device_of_environment() : chosen;
}
void choose_device(int number) { device = number; }

}  // namespace retrograde::runtime
