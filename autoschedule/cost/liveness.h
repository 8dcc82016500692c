// liveness.h -- the bytes that a program has allocated at once.
#pragma once

#include <vector>

namespace retrograde::planning {

// What one buffer takes while these groups run, the first and the last one included.
struct LiveBuffer {
  size_t first, last;
  double bytes;
};

// `own`: what each group allocates for itself alone.
double peak_bytes(const std::vector<LiveBuffer>& buffers, const std::vector<double>& own);

}  // namespace retrograde::planning
