// recent.h -- which buffers were touched last, to tell whether a cache still holds them.
#pragma once

#include <cmath>
#include <vector>

namespace retrograde::planning {

class RecentBuffers {
 public:
  explicit RecentBuffers(size_t buffers)
      : head_(static_cast<int>(buffers)), links_(buffers + 1), bytes_(buffers) {}

  // The bytes that were touched since this one was, with its own; infinite if most of `bytes` were not. Gives up beyond
  // `most`.
  double distance(int buffer, double bytes, double most) const {
    double sum = 0;
    for (int b = link(head_).next; b >= 0 && sum <= most; b = link(b).next) {
      sum += bytes_[static_cast<size_t>(b)];
      if (b == buffer) return 2 * bytes_[static_cast<size_t>(b)] >= bytes ? sum : INFINITY;
    }
    return INFINITY;
  }
  void touch(int buffer, double bytes) {
    if (const auto [before, next] = link(buffer); before >= 0) {
      link(before).next = next;
      if (next >= 0) link(next).before = before;
    }
    const int first = link(head_).next;
    link(buffer) = {head_, first};
    if (first >= 0) link(first).before = buffer;
    link(head_).next = buffer;
    bytes_[static_cast<size_t>(buffer)] = bytes;
  }

 private:
  struct Link {
    int before = -1, next = -1;
  };
  int head_;  // of the list; the latest is first
  std::vector<Link> links_;
  std::vector<double> bytes_;

  Link& link(int buffer) { return links_[static_cast<size_t>(buffer)]; }
  const Link& link(int buffer) const { return links_[static_cast<size_t>(buffer)]; }
};

}  // namespace retrograde::planning
