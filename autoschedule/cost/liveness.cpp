#include "autoschedule/cost/liveness.h"

#include <algorithm>

namespace retrograde::planning {

double peak_bytes(const std::vector<LiveBuffer>& buffers, const std::vector<double>& own) {
  std::vector<double> change(own.size() + 1);
  for (const LiveBuffer& buffer : buffers) {
    change[buffer.first] += buffer.bytes;
    change[buffer.last + 1] -= buffer.bytes;
  }
  double alive = 0, peak = 0;
  for (size_t group = 0; group < own.size(); ++group) {
    alive += change[group];
    peak = std::max(peak, alive + own[group]);
  }
  return peak;
}

}  // namespace retrograde::planning
