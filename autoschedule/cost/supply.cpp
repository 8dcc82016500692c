#include "autoschedule/cost/supply.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ranges>
#include <utility>

#include "autoschedule/cost/assumptions.h"

namespace retrograde::planning {

namespace {

double overlapped(double a, double b) { return std::max(a, b) + not_overlapped * std::min(a, b); }

}  // namespace

double CacheSupply::room(size_t level) const { return usable_share * machine_.levels[level].bytes; }

double CacheSupply::seconds() const {
  double sum = 0;
  for (const Running& group : groups_) sum += group.seconds;
  return sum;
}

// ---- what changes ----

// Buffers of both prices in the same order, with the same bytes, leave as much behind as before.
void CacheSupply::change(size_t number, const GroupPrice* price) {
  static const Touched none;
  Running& group = groups_[number];
  const Touched& before = group.price ? group.price->traffic.touched : none;
  const Touched& after = price ? price->traffic.touched : none;
  auto next = before.begin();
  const auto note_until = [&](auto end) {
    for (; next != end; ++next) note_change(next->first, next->second);
  };
  for (const auto& touched : after) {
    const auto same = std::find(next, before.end(), touched);
    if (same == before.end()) {
      note_change(touched.first, touched.second);
    } else {
      note_until(same);
      ++next;
    }
  }
  note_until(before.end());
  group = {price, {}, 0, 0, 0, true};
}

void CacheSupply::note_change(int id, double bytes) {
  Buffer& changed = buffers_[static_cast<size_t>(id)];
  const double more = std::max(0.0, bytes - changed.most_bytes);
  changed.most_bytes += more;
  const bool is_noted = std::exchange(changed.change, updates_) == updates_;
  changed_bytes_ += is_noted ? more : changed.most_bytes;
}

bool CacheSupply::touches_changed(const Running& group) const {
  return std::ranges::any_of(group.price->traffic.touched, [&](const auto& touched) {
    return buffers_[static_cast<size_t>(touched.first)].change == updates_;
  });
}

void CacheSupply::update() {
  std::optional<size_t> before, last;  // the last group that changed, before this one and of all
  for (size_t g = 0; g < groups_.size(); ++g)
    if (groups_[g].is_changed) last = g;
  for (size_t g = 0; g < groups_.size(); ++g) {
    Running& group = groups_[g];
    const bool is_near = group.since < g ? before >= group.since : before || last >= group.since;
    if (is_near) group.spare_bytes -= changed_bytes_;
    if (group.is_changed) before = g;
    const bool is_other =
        is_near && group.price && (group.spare_bytes <= 0 || touches_changed(group));
    if (group.price && (group.is_changed || is_other)) find_stages(g);
  }
  for (Running& group : groups_) group.is_changed = false;
  ++updates_;
  changed_bytes_ = 0;
}

// ---- what caches hold ----

// Finds, for each buffer of a group, the bytes that were touched since it was, with its own; infinite if most of it was
// not, or the last cache forgot it.
void CacheSupply::find_distances(size_t g) {
  Running& group = groups_[g];
  ++looks_;
  for (const auto& [id, bytes] : group.price->traffic.touched) {
    Buffer& own = buffers_[static_cast<size_t>(id)];
    own.asked_for = looks_;
    own.asked_bytes = bytes;
    own.distance = INFINITY;
  }
  const double most = machine_.levels[Machine::last_cache].bytes;
  size_t left = group.price->traffic.touched.size();
  double sum = 0;
  group.spare_bytes = INFINITY;
  for (size_t back = 1; back <= groups_.size() && left > 0 && sum <= most; ++back) {
    group.since = (g + groups_.size() - back) % groups_.size();
    const Running& earlier = groups_[group.since];
    if (!earlier.price) continue;
    for (const auto& [id, bytes] : std::views::reverse(earlier.price->traffic.touched)) {
      Buffer& touched = buffers_[static_cast<size_t>(id)];
      if (std::exchange(touched.found, looks_) == looks_ || sum > most) continue;
      sum += bytes;
      if (touched.asked_for != looks_) continue;
      --left;
      if (2 * bytes < touched.asked_bytes) continue;
      touched.distance = sum;
      for (size_t level = 0; level <= Machine::last_cache; ++level)
        group.spare_bytes = std::min(group.spare_bytes, std::abs(sum - room(level)));
    }
  }
  if (sum > most) group.spare_bytes = std::min(group.spare_bytes, most - room(Machine::last_cache));
}

double CacheSupply::distance_of(int id) const {
  const Buffer& known = buffers_[static_cast<size_t>(id)];
  return known.asked_for == looks_ ? known.distance : 0;
}

// A cache supplies what the smaller one lacks and it has.
void CacheSupply::find_stages(size_t g) {
  struct Bytes {
    double serial = 0, parallel = 0;
    double waiting_ns = 0;  // of each thread
  };
  Running& group = groups_[g];
  const GroupPrice& price = *group.price;
  std::vector<std::array<Bytes, Machine::level_count>> behind(price.stages.size());
  find_distances(g);
  for (size_t level = 0; level < price.traffic.behind.size(); ++level) {
    for (const BufferTraffic& traffic : price.traffic.behind[level]) {
      const bool is_there = distance_of(traffic.buffer) <= room(level);
      const double bytes = traffic.bytes - (is_there ? traffic.first_bytes : 0);
      Bytes& all = behind[static_cast<size_t>(traffic.run)][level];
      (traffic.in_parallel ? all.parallel : all.serial) += bytes;
      const double threads = traffic.in_parallel ? machine_.threads : 1;
      if (bytes > 0) all.waiting_ns += traffic.waiting_ns * bytes / traffic.bytes / threads;
    }
  }
  group.stages = price.stages;
  group.seconds = 0;
  for (size_t s = 0; s < group.stages.size(); ++s) {
    StageCost& stage = group.stages[s];
    for (size_t level = 1; level < Machine::level_count; ++level) {
      const Bytes &in = behind[s][level - 1], &out = behind[s][level];
      const double serial = std::max(0.0, in.serial - out.serial);
      const double parallel = std::max(0.0, in.parallel - out.parallel);
      const Machine::Level& from = machine_.levels[level];
      const double shared = machine_.threads == 1 ? from.one_thread : from.all_threads;
      stage.bytes[level] += serial + parallel;
      const double moving_ns = serial / from.one_thread + parallel / shared;
      stage.memory_seconds[level] += overlapped(moving_ns, in.waiting_ns) * nanosecond;
    }
    const double memory = stage.all_memory_seconds();
    const double shown = (not_overlapped_with_memory - not_overlapped) *
                         std::min(stage.compute_seconds, stage.memory_seconds.back());
    stage.seconds = overlapped(stage.compute_seconds, memory) + shown + stage.launch_seconds;
    group.seconds += stage.seconds;
  }
}

}  // namespace retrograde::planning
