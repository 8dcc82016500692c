#include "tuning/memory_traffic.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <tuple>

#include "autoschedule/machine/reference.h"

namespace retrograde::tuning {

namespace {

constexpr double line_bytes = planning::line_bytes;
constexpr size_t most_offsets = 64;  // of one group; more are spread as these are

double whole_lines(double bytes) { return std::ceil(bytes / line_bytes) * line_bytes; }

// Iterations of a loop, and bytes from one to the next.
struct Side {
  double trips, bytes;
};

// What sides make of pieces: longer ones where they join, else more.
struct Pieces {
  double span, count = 1;
  void repeat(const Side& side) {
    if (side.bytes <= std::max(span, line_bytes) && count == 1)
      span += side.bytes * (side.trips - 1);
    else
      count *= side.trips;
  }
  double bytes() const { return count * whole_lines(span); }
};

// Whether a piece so far away is one that the loops reach anyway.
bool is_reached(double distance, const std::vector<Side>& sides, double span) {
  for (auto side = sides.rbegin(); side != sides.rend(); ++side) {
    const double steps = std::round(distance / side->bytes);
    if (std::abs(steps) < side->trips) distance -= steps * side->bytes;
  }
  return std::abs(distance) <= std::max(span, line_bytes);
}

}  // namespace

// Accesses in one node that differ in where they begin only.
struct MemoryTraffic::Group {
  MemoryAccess access;
  std::vector<double> offsets;
  std::vector<std::pair<double, bool>> trips;  // by place; whether it is a loop
  double taken = 1;
  double buffer_bytes = 0;

  bool takes(const MemoryAccess& other) const {
    const auto key = [](const MemoryAccess& a) {
      return std::tie(a.buffer, a.is_store, a.stage, a.lane_bytes, a.lane_blocks, a.slopes,
                      a.data_loops);
    };
    return key(access) == key(other);
  }
};

MemoryTraffic::Region MemoryTraffic::region_of(const Group& group, size_t first_place) const {
  const MemoryAccess& access = group.access;
  Pieces pieces{access.lane_bytes, access.lane_blocks};
  std::vector<Side> sides;
  double data_times = 1, reach = 0, taken = 1;
  for (size_t place = first_place; place < group.trips.size(); place++) {
    const auto [trips, is_loop] = group.trips[place];
    if (!is_loop) {
      taken *= trips;
      continue;
    }
    const double slope = place < access.slopes.size() ? std::abs(access.slopes[place]) : 0;
    if (slope > 0)
      sides.push_back({trips, slope});
    else if (place < 64 && (access.data_loops >> place & 1))
      data_times *= trips;
    reach += slope * (trips - 1) / 2;
  }
  std::ranges::sort(sides, {}, &Side::bytes);
  for (const Side& side : sides) pieces.repeat(side);
  double apart = 0;
  std::vector<double> first;  // offsets that others are not reached from
  for (const double offset : group.offsets) {
    const bool reached = std::ranges::any_of(
        first, [&](double from) { return is_reached(offset - from, sides, pieces.span); });
    if (reached) continue;
    first.push_back(offset);
    apart++;
  }
  Region result{access.buffer, access.stage, access.is_store, access.in_parallel};
  result.bytes = pieces.bytes() * std::max(1.0, apart) * std::min(1.0, taken);
  if (access.data_range > 0 && data_times > 1)
    result.bytes = std::min(result.bytes * data_times, std::max(access.data_range, result.bytes));
  if (group.buffer_bytes > 0)
    result.bytes = std::min(result.bytes, whole_lines(group.buffer_bytes));
  result.low = group.offsets.front() - reach;
  result.high = group.offsets.back() + reach + access.lane_bytes;
  return result;
}

// One for each buffer: regions that overlap are touched once, those beside each other both.
std::vector<MemoryTraffic::Region> MemoryTraffic::regions(const std::vector<const Group*>& groups,
                                                          size_t first_place) const {
  std::vector<std::vector<Region>> by_buffer(tree_.buffers.size());
  std::vector<int> order;
  for (const Group* group : groups) {
    Region next = region_of(*group, first_place);
    std::vector<Region>& known = by_buffer[static_cast<size_t>(next.buffer)];
    if (known.empty()) order.push_back(next.buffer);
    const auto same = std::ranges::find_if(known, [&](const Region& r) {
      const double shared = std::min(r.high, next.high) - std::max(r.low, next.low);
      return shared > 0.5 * std::min(r.high - r.low, next.high - next.low);
    });
    if (same == known.end()) {
      known.push_back(next);
      continue;
    }
    same->bytes = std::max(same->bytes, next.bytes);
    same->low = std::min(same->low, next.low);
    same->high = std::max(same->high, next.high);
    same->is_stored = same->is_stored || next.is_stored;
  }
  std::vector<Region> result;
  for (const int buffer : order) {
    const std::vector<Region>& parts = by_buffer[static_cast<size_t>(buffer)];
    Region all = parts.front();
    for (size_t i = 1; i < parts.size(); i++) {
      all.bytes += parts[i].bytes;
      all.is_stored = all.is_stored || parts[i].is_stored;
    }
    const double most = tree_.buffers[static_cast<size_t>(buffer)].bytes;
    if (most > 0) all.bytes = std::min(all.bytes, whole_lines(most));
    result.push_back(all);
  }
  return result;
}

MemoryTraffic::MemoryTraffic(const WorkTree& tree) : tree_(tree) {
  const size_t count = tree.nodes.size();
  std::deque<Group> all;
  std::vector<std::vector<const Group*>> inside(count);  // of a node and all in it, in their order
  const auto gather = [&](const auto& self, size_t n,
                          std::vector<std::pair<double, bool>> trips) -> void {
    const WorkNode& node = tree.nodes[n];
    trips.emplace_back(node.trips, node.is_loop());
    std::vector<Group*> own;
    for (const MemoryAccess& access : node.accesses) {
      const auto known = std::ranges::find_if(own, [&](Group* g) { return g->takes(access); });
      if (known != own.end()) {
        (*known)->access.data_range = std::max((*known)->access.data_range, access.data_range);
        if ((*known)->offsets.size() < most_offsets) (*known)->offsets.push_back(access.at);
        continue;
      }
      Group& group = all.emplace_back();
      group.access = access;
      group.offsets = {access.at};
      group.trips = trips;
      group.buffer_bytes = tree.buffers[static_cast<size_t>(access.buffer)].bytes;
      own.push_back(&group);
    }
    for (Group* group : own) {
      std::ranges::sort(group->offsets);
      inside[n].push_back(group);
    }
    for (const int child : node.children) {
      self(self, static_cast<size_t>(child), trips);
      const auto& more = inside[static_cast<size_t>(child)];
      inside[n].insert(inside[n].end(), more.begin(), more.end());
    }
  };
  gather(gather, 0, {});
  for (size_t n = 0; n < count; n++) {
    runs_.push_back(regions(inside[n], tree.nodes[n].place));
    iterations_.push_back(tree.nodes[n].is_loop() ? regions(inside[n], tree.nodes[n].place + 1)
                                                  : runs_.back());
  }
}

double MemoryTraffic::run_bytes(int node) const {
  double sum = 0;
  for (const Region& region : runs_[static_cast<size_t>(node)]) sum += region.bytes;
  return sum;
}

// What was touched, the latest first.
struct MemoryTraffic::Recent {
  std::vector<std::pair<int, double>> buffers;

  // Whether all of a region that was touched then is still within so many bytes.
  bool holds(const Region& region, double cache_bytes) const {
    double sum = 0;
    for (const auto& [buffer, bytes] : buffers) {
      sum += bytes;
      if (sum > cache_bytes) return false;
      if (buffer == region.buffer) return bytes >= 0.5 * region.bytes;
    }
    return false;
  }
  void touch(std::vector<Region> regions) {
    // Small ones are used all the time while large ones stream by.
    std::ranges::stable_sort(regions, std::greater(), &Region::bytes);
    for (const Region& region : regions) {
      std::erase_if(buffers, [&](const auto& known) { return known.first == region.buffer; });
      buffers.insert(buffers.begin(), {region.buffer, region.bytes});
    }
  }
};

class MemoryTraffic::Walk {
 public:
  Walk(const MemoryTraffic& of, double cache_bytes)
      : of_(of), cache_bytes_(cache_bytes), found_(of.tree_.stages.size()) {}

  void run(size_t n, double times, bool counts) {
    const WorkNode& node = of_.tree_.nodes[n];
    const auto& all = of_.runs_[n];
    const double iteration = sum(of_.iterations_[n]);
    if (sum(all) <= cache_bytes_ || (node.is_loop() && iteration <= cache_bytes_))
      return load(all, times, counts);
    times *= node.trips;
    // Own accesses come with the first part: they are few where there are parts.
    if (node.children.empty()) return load(of_.iterations_[n], times, counts);
    for (const int child : node.children) run(static_cast<size_t>(child), times, counts);
  }

  std::vector<Traffic> found() const { return found_; }

 private:
  const MemoryTraffic& of_;
  const double cache_bytes_;
  std::vector<Traffic> found_;
  Recent recent_;

  static double sum(const std::vector<Region>& regions) {
    double result = 0;
    for (const Region& region : regions) result += region.bytes;
    return result;
  }

  void load(const std::vector<Region>& regions, double times, bool counts) {
    for (const Region& region : regions) {
      if (!counts || recent_.holds(region, cache_bytes_)) continue;
      Traffic& traffic = found_[static_cast<size_t>(region.stage)];
      (region.in_parallel ? traffic.parallel_bytes : traffic.serial_bytes) +=
          times * region.bytes * (region.is_stored ? 2 : 1);
    }
    recent_.touch(regions);
  }
};

std::vector<Traffic> MemoryTraffic::behind(double cache_bytes) const {
  Walk walk(*this, cache_bytes);
  walk.run(0, 1, false);
  walk.run(0, 1, true);
  return walk.found();
}

}  // namespace retrograde::tuning
