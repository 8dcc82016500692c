// Writes to file descriptors.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>

namespace retrograde::runtime {

// Writes all bytes, also if the system takes them in parts. False on an error.
inline bool write_all(int file, const char* data, size_t bytes) {
  while (bytes > 0) {
    const ssize_t written = write(file, data, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    data += written;
    bytes -= static_cast<size_t>(written);
  }
  return true;
}

}  // namespace retrograde::runtime
