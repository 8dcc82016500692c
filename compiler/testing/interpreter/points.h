// points.h -- points of a Func's domain, and boxes around them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "testing/array.h"

namespace retrograde::oracle {

using Point = std::vector<int>;

struct PointHash {
  size_t operator()(const Point& point) const {
    uint64_t hash = 0x9e3779b97f4a7c15u;
    for (const int x : point) {
      hash = (hash ^ static_cast<uint32_t>(x)) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

// A growing box; empty until the first point.
struct Hull {
  Point mins, maxs;
  bool empty = true;

  bool contains(const Point& p) const {
    if (empty) return false;
    for (size_t d = 0; d < p.size(); ++d) {
      if (p[d] < mins[d] || p[d] > maxs[d]) return false;
    }
    return true;
  }
  void include(const Point& p) {
    if (empty) {
      mins = maxs = p;
      empty = false;
    }
    for (size_t d = 0; d < p.size(); ++d) {
      mins[d] = std::min(mins[d], p[d]);
      maxs[d] = std::max(maxs[d], p[d]);
    }
  }
  bool contains(const Hull& other) const {
    return other.empty || (contains(other.mins) && contains(other.maxs));
  }
  void include(const Hull& other) {
    if (other.empty) return;
    include(other.mins);
    include(other.maxs);
  }
  Region region() const {
    Region result;
    for (size_t d = 0; d < mins.size(); ++d) {
      result.mins.push_back(mins[d]);
      result.extents.push_back(maxs[d] - mins[d] + 1);
    }
    return result;
  }
};

inline bool is_inside(const Region& box, const Point& point) {
  for (size_t d = 0; d < point.size(); ++d) {
    if (point[d] < box.mins[d] || point[d] >= box.mins[d] + box.extents[d]) return false;
  }
  return true;
}

// "(3, -4)"
inline std::string to_string(const Point& point) {
  std::string result = "(";
  for (size_t d = 0; d < point.size(); ++d) {
    result += (d ? ", " : "") + std::to_string(point[d]);
  }
  return result + ")";
}

}  // namespace retrograde::oracle
