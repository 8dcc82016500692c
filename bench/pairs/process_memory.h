// process_memory.h -- how much memory a worker's process holds and held (Linux).
#pragma once

#include <fstream>
#include <string>

namespace bench {

// A field of "/proc/self/status" that counts KiB.
inline double status_mb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(field + ":", 0) == 0) return std::stod(line.substr(field.size() + 1)) / 1024;
  }
  return 0;
}

// The peak from now on (Linux 4.0); where that is not allowed, RUN_MB counts from the old peak.
inline void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace bench
