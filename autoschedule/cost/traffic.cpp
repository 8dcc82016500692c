// The outermost loops whose run fits into a cache load what they touch once. Loops of which one iteration fits do, too:
// what iterations share, such as the rows of a stencil, is used again while it is there. Farther out, all is loaded anew.
// Source: Wolf and Lam, "A Data Locality Optimizing Algorithm" (PLDI 1991).
#include "autoschedule/cost/terms.h"

#include <algorithm>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/recent.h"
#include "autoschedule/machine/reference.h"

namespace retrograde::planning {

namespace {

// The bytes between lines of one set of a core's own caches. Processors scatter lines over the sets of the last cache.
constexpr std::array<int64_t, Machine::last_cache> set_strides{page_bytes, second_cache_set_stride};

// The part of a buffer that is touched.
struct Region {
  int buffer = 0, run = 0;
  double bytes = 0;
  // The lines that data choose, each as often as it is touched; and all that one iteration chooses from.
  double scattered_bytes = 0, choice_bytes = 0;
  std::array<double, set_strides.size()> by_sets =
      {};  // a stride that leaves sets out fills others
  bool is_stored = false;
  // Lines that nothing fetches ahead, and of these, those that begin a page.
  double far_lines = 0, far_pages = 0;
  double late_lines = 0;       // that were not on their way when a core's second cache lacked them
  double revisited_lines = 0;  // that are stored to again, after the lines of all other streams
  // Lines that are stored are loaded before.
  double moved_bytes() const { return bytes * (is_stored ? 2 : 1); }
};
using Regions = std::vector<Region>;

double bytes_of(const Regions& regions) {
  double sum = 0;
  for (const Region& region : regions) sum += region.bytes;
  return sum;
}

// The elements that an iteration chooses from, if it is no neighbour of the last one's.
double choice_of(const Touch& touch) {
  double elements = 1;
  for (const TouchedSide& side : touch.sides)
    if (side.data != 0 && !side.is_displaced) elements *= side.most;
  return touch.is_own ? 1 : elements;
}
double scattered_bytes(const Touch& touch, const Layout& layout, const Cover& cover) {
  if (choice_of(touch) == 1) return 0;
  return touched_lines(touch, layout, Cover(cover.size(), 1)) * iterations_of(touch.moved, cover) *
         line_bytes;
}

class RegionFinder {
 public:
  explicit RegionFinder(const Group& group) : group_(group), below_(group.nodes.size()) {
    for (size_t r = 0; r < group.runs.size(); ++r) {
      for (const int node : group.runs[r].path) below_[static_cast<size_t>(node)].push_back(r);
      stages_.emplace_back(group.runs[r], group);
    }
    runs_.resize(group.nodes.size());
    iterations_.resize(group.nodes.size());
  }
  // While all iterations of a node run, and one of them.
  const Regions& run(int node) { return find(runs_, static_cast<size_t>(node), 0); }
  const Regions& iteration(int node) {
    const std::vector<int>& children = group_.nodes[static_cast<size_t>(node)].children;
    const bool is_child =
        children.size() == 1 && group_.nodes[static_cast<size_t>(node)].stages.empty();
    return is_child ? run(children[0]) : find(iterations_, static_cast<size_t>(node), 1);
  }
  // The touches of the stages whose innermost loop it is.
  Regions own(int node) {
    Regions result;
    for (const int run : group_.nodes[static_cast<size_t>(node)].stages)
      add(result, static_cast<size_t>(run), group_.runs[static_cast<size_t>(run)].path.size());
    return sorted(std::move(result));
  }

 private:
  // The regions that one stage touches while the loops of its path from any depth inwards run.
  class StageRegions {
   public:
    StageRegions(const StageRun& run, const Group& group) : run_(run) {
      for (const Touch& touch : run.facts->touches) {
        const StoredBuffer& stored = group.buffers.at(touch.buffer);
        if (stored.register_share < 1)
          touches_.push_back({touch, stored, streams_of(run, touch, stored, group)});
      }
    }
    const Regions& from(size_t depth) {
      while (regions_.size() <= depth) regions_.push_back(find(regions_.size()));
      return regions_[depth];
    }

   private:
    // A touch, and what it was in the last loops that were looked at.
    struct Seen {
      const Touch& touch;
      const StoredBuffer& stored;
      const Streams streams;
      const Cover* cover = nullptr;
      double lines = 0, scattered = 0;
      std::array<double, set_strides.size()> by_sets = {};

      void look_at(const Cover& next) {
        const IteratorSet moves = touch.moved | touch.data;
        bool is_known = cover != nullptr;
        for (size_t i = 0; is_known && i < next.size(); ++i)
          is_known = next[i] == (*cover)[i] || (moves & set_of(static_cast<int>(i))) == 0;
        cover = &next;
        if (is_known) return;
        lines = touched_lines(touch, stored.layout, next);
        scattered = scattered_bytes(touch, stored.layout, next);
        for (size_t c = 0; c < set_strides.size(); ++c)
          by_sets[c] = bytes_by_sets(touch, stored.layout, next, set_strides[c]);
      }
    };
    const StageRun& run_;
    std::vector<Seen> touches_;
    std::vector<Regions> regions_;  // by loop

    // Touches of one stage are different parts of a buffer.
    Regions find(size_t from) {
      Regions own;
      for (Seen& seen : touches_) {
        const auto& [touch, stored, streams, cover, lines, scattered, by_sets] = seen;
        const double share = 1 - stored.register_share;
        seen.look_at(run_.cover[std::min(std::max(from, stored.inside), run_.cover.size() - 1)]);
        const double most = std::ceil(stored.layout.elements() * touch.element_bytes / line_bytes);
        const double bytes = share * std::min(lines, most * touch.components) * line_bytes;
        Region& region = of_buffer(own, touch.buffer);
        region.scattered_bytes += share * scattered;
        region.choice_bytes =
            std::max(region.choice_bytes, choice_of(touch) * touch.element_bytes * share);
        const bool is_same = touch.is_own || touch.carried;  // as what the stage writes
        region.bytes =
            is_same ? std::max(region.bytes, bytes)
                    : std::min(region.bytes + bytes, share * most * touch.components * line_bytes);
        region.is_stored = region.is_stored || touch.writes;
        if (touch.writes) region.revisited_lines = bytes / line_bytes * (1 - 1 / streams.visits);
        if (streams.count > prefetched_streams) {
          const double all = bytes / line_bytes, far = all / streams.lines;
          region.far_lines = std::max(region.far_lines, far);
          region.late_lines = std::max(region.late_lines, std::min(all, unnoticed_lines * far));
          if (streams.count > remembered_pages) region.far_pages = std::max(region.far_pages, far);
        }
        for (size_t c = 0; c < set_strides.size(); ++c)
          region.by_sets[c] = std::max(region.by_sets[c], share * by_sets[c]);
      }
      return own;
    }
  };

  const Group& group_;
  std::vector<std::vector<size_t>> below_;  // the stages in a node
  std::vector<StageRegions> stages_;
  std::vector<Regions> runs_, iterations_;  // of nodes that were asked for

  const Regions& find(std::vector<Regions>& known, size_t n, size_t inside) {
    if (!known[n].empty()) return known[n];
    for (const size_t r : below_[n]) {
      const std::vector<int>& path = group_.runs[r].path;
      const auto at = std::ranges::find(path, static_cast<int>(n)) - path.begin();
      add(known[n], r, static_cast<size_t>(at) + inside);
    }
    return known[n] = sorted(std::move(known[n]));
  }
  // Small ones are used all the time while large ones stream by: as if they were touched last.
  static Regions sorted(Regions regions) {
    std::ranges::stable_sort(regions, std::greater(), &Region::bytes);
    return regions;
  }

  // Stages touch the same parts of a buffer.
  void add(Regions& regions, size_t r, size_t from) {
    for (const Region& region : stages_[r].from(from)) {
      Region& all = of_buffer(regions, region.buffer);
      if (region.bytes > all.bytes) all.run = static_cast<int>(r);
      all.bytes = std::max(all.bytes, region.bytes);
      all.scattered_bytes += region.scattered_bytes;
      all.choice_bytes = std::max(all.choice_bytes, region.choice_bytes);
      all.is_stored = all.is_stored || region.is_stored;
      all.far_lines = std::max(all.far_lines, region.far_lines);
      all.far_pages = std::max(all.far_pages, region.far_pages);
      all.late_lines = std::max(all.late_lines, region.late_lines);
      all.revisited_lines = std::max(all.revisited_lines, region.revisited_lines);
      for (size_t c = 0; c < set_strides.size(); ++c)
        all.by_sets[c] = std::max(all.by_sets[c], region.by_sets[c]);
    }
  }

  static Region& of_buffer(Regions& regions, int buffer) {
    Region* known =
        ir::first_where(regions, [&](const Region& region) { return region.buffer == buffer; });
    return known ? *known : regions.emplace_back(Region{buffer});
  }
};

class TrafficWalk {
 public:
  TrafficWalk(const Group& group, RegionFinder& regions, const Machine& machine, size_t level)
      : group_(group),
        regions_(regions),
        machine_(machine),
        level_(level),
        recent_(static_cast<size_t>(group.buffers.rbegin()->first) + 1) {}

  std::vector<BufferTraffic> find() {
    visit(0, 1);
    for (const Region& region : regions_.run(0)) {
      double left = region.moved_bytes();
      for (BufferTraffic& traffic : found_) {
        if (traffic.buffer != region.buffer) continue;
        traffic.first_bytes = std::min(left, traffic.bytes);
        left -= traffic.first_bytes;
      }
    }
    return std::move(found_);
  }

 private:
  const Group& group_;
  RegionFinder& regions_;
  const Machine& machine_;
  const size_t level_;
  RecentBuffers recent_;
  std::vector<int>
      held_;  // buffers that stay in the cache from one iteration of an outer loop to the next
  std::vector<BufferTraffic> found_;

  // The threads share the last cache, one iteration of a parallel loop each.
  double room(bool in_parallel) const {
    const double bytes = usable_share * machine_.levels[level_].bytes;
    const bool is_shared = in_parallel && level_ == Machine::last_cache;
    return is_shared ? bytes / machine_.threads : bytes;
  }

  // Whether the fullest sets of a region have room for it and for what others bring, which lie in all sets evenly. One line
  // has room anyway.
  bool has_sets(const Region& region, double others_bytes = 0) const {
    return level_ >= set_strides.size() ||
           region.by_sets[level_] - double(set_strides[level_]) + others_bytes <
               machine_.levels[level_].bytes;
  }

  // The share of lines that are gone when they are used again after all others. A cache that forgets the line of the
  // longest wait would lose all of them; caches protect themselves, about as if they forgot any line: if each use loses
  // the share m, a line survives the m x bytes / line_bytes others that are loaded with probability exp(-m x bytes / room).
  double lost_share(const Regions& regions, double room) const {
    const double excess = bytes_of(regions) / room;
    const auto has_own_sets = [&](const Region& region) { return has_sets(region); };
    if (!std::ranges::all_of(regions, has_own_sets) || excess > most_excess) return 1;
    double lost = 1;
    for (int i = 0; i < 40; ++i) lost = 1 - std::exp(-lost * excess);
    return lost;
  }

  // Loads the regions of a run that keep their lines while all of `touched` are. Returns whether these are all.
  bool load_kept(const Regions& run, const Regions& touched, double times, int n) {
    const double bytes = bytes_of(touched);
    Regions kept = run;
    for (const Region& region : touched) {
      if (!has_sets(region, bytes - region.bytes))
        std::erase_if(kept, [&](const Region& r) { return r.buffer == region.buffer; });
    }
    load(kept, times, n, false);
    for (const Region& region : kept) held_.push_back(region.buffer);
    return kept.size() == run.size();
  }

  // Unrolled copies load once what each of them reads.
  void load_for_copies(int n, double times) {
    if (group_.nodes[static_cast<size_t>(n)].kind != ForType::Unrolled) return;
    const Regions& one = regions_.iteration(n);
    Regions shared = regions_.run(n);
    std::erase_if(shared, [&](const Region& all) {
      return all.is_stored || std::ranges::none_of(one, [&](const Region& region) {
               return region.buffer == all.buffer && region.bytes == all.bytes;
             });
    });
    load(shared, times, n, true);
    for (const Region& region : shared) held_.push_back(region.buffer);
  }

  void visit(int n, double times) {
    const LoopNode& node = group_.nodes[static_cast<size_t>(n)];
    times *= node.share;
    const bool outside =
        node.parent < 0 || !group_.nodes[static_cast<size_t>(node.parent)].in_parallel;
    const bool is_loop = node.parent >= 0;
    const Regions& all = regions_.run(n);
    const Regions& in_turn = is_loop ? regions_.iteration(n) : all;
    const bool fits =
        bytes_of(all) <= room(!outside) || (is_loop && bytes_of(in_turn) <= room(node.in_parallel));
    const size_t held = held_.size();
    const bool is_done = fits && load_kept(all, in_turn, times, n);
    if (is_done) return held_.resize(held);
    const double kept = is_loop && !fits ? 1 - lost_share(in_turn, room(node.in_parallel)) : 0;
    if (kept > 0) {
      const RecentBuffers before = recent_;
      load(regions_.run(n), times * kept, n, false);
      recent_ = before;
    }
    times *= node.trips * (1 - kept);
    for (const int child : node.children) {
      load_for_copies(child, times);
      visit(child, times);
    }
    if (!node.stages.empty()) load(regions_.own(n), times, n, true);
    held_.resize(held);
    // All iterations have passed, not only those that were looked at.
    for (const Region& region : regions_.run(n)) recent_.touch(region.buffer, region.bytes);
  }

  // How often a run loads its lines. Those that lie anywhere are gone when they are touched again, but for the part of
  // them that the cache holds.
  static double loads_of(const Region& region, double room) {
    const double again = std::max(0.0, region.scattered_bytes / region.bytes - 1);
    return 1 + again * std::max(0.0, 1 - room / std::min(region.bytes, region.choice_bytes));
  }

  // `are_evicted`: lines are before they are touched again.
  double waiting_ns(const Region& region, bool are_evicted) const {
    double ns = (level_ == 0 ? region.far_lines : region.late_lines) * far_line_ns[level_];
    if (level_ == 0) ns += region.far_pages * page_walk_ns;
    if (level_ == 0 && are_evicted) ns += region.revisited_lines * evicted_store_ns;
    return ns;
  }

  // `in_turn`: of one iteration, in which lines may be evicted before they are touched again.
  void load(const Regions& regions, double times, int n, bool in_turn) {
    const double most = room(group_.nodes[static_cast<size_t>(n)].in_parallel);
    const double all_bytes = bytes_of(regions);
    for (const Region& region : regions) {
      if (std::ranges::count(held_, region.buffer) > 0) continue;
      if (has_sets(region) && recent_.distance(region.buffer, region.bytes, most) <= most) continue;
      const StageRun& run = group_.runs[static_cast<size_t>(region.run)];
      const bool in_parallel = group_.nodes[static_cast<size_t>(run.path.back())].in_parallel;
      const double waiting =
          times * waiting_ns(region, in_turn && !has_sets(region, all_bytes - region.bytes));
      const double bytes = times * loads_of(region, most) * region.moved_bytes();
      found_.push_back({region.run, region.buffer, bytes, 0, waiting, in_parallel});
    }
    for (const Region& region : regions) recent_.touch(region.buffer, region.bytes);
  }
};

}  // namespace

GroupTraffic traffic_of(const Group& group, const Machine& machine) {
  RegionFinder regions(group);
  GroupTraffic result;
  for (size_t level = 0; level < result.behind.size(); ++level)
    result.behind[level] = TrafficWalk(group, regions, machine, level).find();
  for (const Region& region : regions.run(0))
    result.touched.emplace_back(region.buffer, region.bytes);
  return result;
}

}  // namespace retrograde::planning
