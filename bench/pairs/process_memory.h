// process_memory.h -- the current and peak memory of a worker's process (Linux).
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

// Resets the peak (Linux 4.0); if that is not permitted, RUN_MB counts from the old peak.
inline void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

}  // namespace bench
