#include "gpu/assembler.h"

#include <atomic>

#include "gpu/programs.h"

namespace retrograde::runtime {
namespace {

std::atomic<retrograde_assembler> assembler{nullptr};
std::atomic<bool> asks_for_simulated{false};

struct Loading {
  const Session& session;
  Module& module;
  bool is_done;
};

void load(void* closure, const void* code, size_t) {
  auto& loading = *static_cast<Loading*>(closure);
  loading.is_done = loading.session.driver().cuModuleLoadDataEx(&loading.module, code, 0, nullptr,
                                                                nullptr) == success;
}

}  // namespace

// If any step fails, the driver still has the PTX to compile.
bool load_assembled(const Session& session, const char* ptx, uint64_t bytes, Module& module) {
  const retrograde_assembler assemble = assembler.load();
  const Driver& driver = session.driver();
  if (!assemble || (driver.is_simulated && !asks_for_simulated)) return false;
  int version = 0, major = 0, minor = 0;
  const Device device = session.device().number;
  const bool is_known = driver.cuDriverGetVersion(&version) == success &&
                        driver.cuDeviceGetAttribute(&major, attribute_major, device) == success &&
                        driver.cuDeviceGetAttribute(&minor, attribute_minor, device) == success;
  if (!is_known) return false;
  const retrograde_assembler_request request = {ptx, bytes, 10 * major + minor, version};
  Loading loading = {session, module, false};
  assemble(&request, load, &loading);
  return loading.is_done;
}

}  // namespace retrograde::runtime

void retrograde_set_assembler(retrograde_assembler given, int32_t is_simulated) {
  retrograde::runtime::asks_for_simulated = is_simulated != 0;
  retrograde::runtime::assembler = given;
}
