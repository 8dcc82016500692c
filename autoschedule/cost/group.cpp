#include "autoschedule/cost/group.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/plan/nest.h"
#include "autoschedule/plan/readers.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

class GroupBuilder {
 public:
  GroupBuilder(const Plan& plan, Covers& covers, const SizeModel& sizes, const Machine& machine,
               FactsOfStages& facts)
      : plan_(plan), covers_(covers), sizes_(sizes), machine_(machine), facts_(facts) {}

  Group build(const PlannedGroup& planned) {
    size_t next = 0;
    for (const FuncId func : planned.funcs) {
      for (const StageNode& stage : stages(func)) inlined_[stage.id] = &planned.inlined[next++];
    }
    group_.nodes.emplace_back();
    for (const auto& [stage, inlined] : inlined_) add(stage);
    for (auto& [stage, run] : runs_) {
      group_.nodes[static_cast<size_t>(run.path.back())].stages.push_back(
          static_cast<int>(group_.runs.size()));
      group_.runs.push_back(std::move(run));
    }
    for (LoopNode& node : group_.nodes) {
      std::ranges::sort(node.children, {}, [&](int child) {
        return std::pair(group_.nodes[static_cast<size_t>(child)].loop.stage, child);
      });
    }
    add_buffers(plan_, sizes_, machine_, group_);
    add_inner_lanes(sizes_, machine_, group_);
    return std::move(group_);
  }

 private:
  const Plan& plan_;
  Covers& covers_;
  const SizeModel& sizes_;
  const Machine& machine_;
  FactsOfStages& facts_;
  Group group_;
  std::map<StageId, const std::vector<FuncId>*> inlined_;
  std::map<StageId, StageRun> runs_;

  const LoopNode& node(int index) const { return group_.nodes[static_cast<size_t>(index)]; }
  const std::vector<StageNode>& stages(FuncId func) const {
    return sizes_.graph().func(func).stages;
  }
  // Opaque Funcs have the loops of their definitions.
  Nest loops_of(StageId stage) const {
    if (plan_.of(stage.func).opacity == Opacity::None) return plan_.nest(stage);
    return loops_of_definition(*plan_.program->funcs[static_cast<size_t>(stage.func)], stage.stage);
  }
  bool is_at(FuncId func) const { return plan_.of(func).placement.compute.kind == Level::Kind::At; }
  static bool is_lane_loop(const StageRun& run, size_t depth) {
    return run.nest.lanes.iterator >= 0 && run.nest.lanes.depth == static_cast<int>(depth);
  }
  static bool is_around_all(const LoopRef& loop) { return loop.depth == around_all_loops; }

  // ---- loops ----

  const StageRun& add(StageId stage) {
    if (const StageRun* known = ir::find_or_null(runs_, stage)) return *known;
    const Nest nest = loops_of(stage);
    StageRun run;
    run.id = stage;
    run.facts = &facts_.of(stage, *inlined_.at(stage));
    run.path = path_around(stage, nest, run.place);
    run.storage_place = is_at(stage.func) ? store_place(run) : 1;
    const Cover extents = extents_of(run);
    run.nest = nest_trips(nest, extents);
    for (size_t depth = run.path.size() - run.place; depth < nest.loops.size(); ++depth)
      run.path.push_back(add_node(
          run.path.back(), {stage, static_cast<int16_t>(depth)}, nest.loops[depth].kind,
          is_lane_loop(run, depth) ? 1 : run.nest.trips[depth], depth == 0 ? run.share : 1));
    run.cover = covers_of(run, nest, extents);
    if (run.nest.lanes.iterator >= 0) run.nest.lanes.block = block_of(run);
    return runs_.emplace(stage, std::move(run)).first->second;
  }

  // The nodes of other stages around the stage's own loops; `place` is how many of them are no loops of its nest.
  std::vector<int> path_around(StageId stage, const Nest& nest, size_t& place) {
    if (nest.shared_with && nest.shared_with->stage != stage) {
      const LoopRef shared = *nest.shared_with;
      const StageRun& other = add(shared.stage);
      place = other.place;
      return prefix(other, shared.depth);
    }
    std::vector<int> path{0};
    if (is_at(stage.func)) {
      const Level level = level_of(stage.func);
      if (level.loop.stage.func != stage.func)
        path = prefix(add(level.loop.stage), level.loop.depth);
    }
    place = path.size();
    return path;
  }
  // Where a Func is computed: of loops alike, that of the first stage that reads it.
  Level level_of(FuncId func) {
    Level level = plan_.of(func).placement.compute;
    if (!level.in_each_stage) return level;
    for (const StageNode& reader : stages(level.loop.stage.func)) {
      const auto& touches = facts_.of(reader.id, *inlined_.at(reader.id)).touches;
      const auto depth = depth_in(plan_, reader.id, level);
      if (!depth || std::ranges::find(touches, func, &Touch::buffer) == touches.end()) continue;
      level.loop = {reader.id, static_cast<int16_t>(*depth)};
      break;
    }
    return level;
  }
  // Down to this loop of the stage.
  static std::vector<int> prefix(const StageRun& run, int depth) {
    const size_t count = std::min(run.path.size(), run.place + static_cast<size_t>(depth + 1));
    return {run.path.begin(), run.path.begin() + static_cast<std::ptrdiff_t>(count)};
  }

  int add_node(int parent, const LoopRef& loop, ForType kind, double trips, double share) {
    LoopNode child;
    const LoopNode& outer = node(parent);
    child.parent = parent;
    child.loop = loop;
    child.kind = kind;
    child.trips = trips;
    child.share = share;
    child.times = outer.times * share * trips;
    child.in_parallel = outer.in_parallel || runs_at_once(kind);
    child.speedup = outer.speedup;
    child.chunks = outer.chunks;
    if (runs_at_once(kind)) {
      // Threads take chunks of all loops around. The last round may leave some without a chunk.
      child.chunks *= trips;
      if (child.chunks > 1)
        child.speedup = child.chunks / (std::ceil(child.chunks / machine_.threads) + late_chunk);
    }
    const int index = static_cast<int>(group_.nodes.size());
    group_.nodes.push_back(std::move(child));
    group_.nodes[static_cast<size_t>(parent)].children.push_back(index);
    return index;
  }

  // The points of the lanes' iterator inside of the innermost loop along it that is neither of lanes nor unrolled.
  double block_of(const StageRun& run) const {
    const auto i = static_cast<size_t>(run.nest.lanes.iterator);
    size_t k = run.path.size() - 1;
    const auto is_copy = [&] {
      const ForType kind = node(run.path[k]).kind;
      return kind == ForType::Unrolled || kind == ForType::Vectorized;
    };
    while (k > 0 && (is_copy() || run.cover[k][i] == run.cover[k + 1][i])) --k;
    return static_cast<double>(run.cover[k > 0 ? k + 1 : 0][i]);
  }

  // ---- points ----

  // The box of a Func that is computed in loops, in one iteration of the last of `count` nodes of a path; of the root,
  // the whole Func.
  std::vector<int64_t> box_in(FuncId func, const std::vector<int>& path, size_t count) {
    if (count <= 1) {
      return ir::numbered(sizes_.graph().func(func).func->args.size(), [&](size_t d) {
        return std::max<int64_t>(sizes_.of(func, d).estimate, 1);
      });
    }
    const Level& compute = plan_.of(func).placement.compute;
    Level level = compute;
    level.loop = node(path[count - 1]).loop;
    level.in_each_stage = compute.in_each_stage && level.loop.stage.func == compute.loop.stage.func;
    return covers_.box(func, level);
  }

  // The points of all loops of the nest. Where a Func is stored outside of the loop in which it is computed, an iteration
  // computes only what the iteration before has not.
  Cover extents_of(StageRun& run) {
    if (!is_at(run.id.func) || run.place <= 1) return whole_cover(run.id, sizes_);
    std::vector<int64_t> box = box_in(run.id.func, run.path, run.place);
    const std::vector<int64_t> all = box;
    run.kept.assign(box.size(), 0);
    for (size_t count = run.place - 1; count >= run.storage_place; --count) {
      const std::vector<int64_t> outer = box_in(run.id.func, run.path, count);
      const double trips = full_trips(run.path[count], count);
      for (size_t d = 0; d < box.size(); ++d) {
        if (outer[d] <= all[d] || run.kept[d] > 0 || trips <= 1) continue;
        run.kept[d] = static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(all[d])));
        const double step = double(outer[d] - all[d]) / (trips - 1);
        box[d] = std::clamp<int64_t>(static_cast<int64_t>(std::ceil(step)), 1, all[d]);
        run.share *= double(outer[d]) / (trips * double(box[d]));
      }
    }
    return cover_of_box(run.id, box, sizes_);
  }

  // How often a loop around other Funcs runs where no border cuts it short. Its covers are those of such a run, too.
  double full_trips(int loop, size_t count) const {
    const StageRun& run = runs_.at(node(loop).loop.stage);
    double trips = 1;
    for (size_t i = 0; i < run.cover[count].size(); ++i)
      trips *= std::ceil(double(run.cover[count][i]) / double(run.cover[count + 1][i]));
    return trips;
  }

  size_t store_place(const StageRun& run) const {
    const Level& store = plan_.of(run.id.func).placement.store;
    if (store.kind == Level::Kind::Root) return 1;
    if (store.kind != Level::Kind::At || is_around_all(store.loop)) return run.place;
    for (size_t k = 1; k < run.place; ++k)
      if (node(run.path[k]).loop == store.loop) return k + 1;
    return run.place;
  }

  std::vector<Cover> covers_of(const StageRun& run, const Nest& nest, const Cover& extents) {
    std::vector<Cover> result{whole_cover(run.id, sizes_)};
    const bool at = is_at(run.id.func);
    for (size_t count = 1; count < run.place; ++count)
      result.push_back(at ? cover_of_box(run.id, box_in(run.id.func, run.path, count), sizes_)
                          : result[0]);
    result.push_back(extents);
    const bool is_opaque = plan_.of(run.id.func).opacity != Opacity::None;
    for (size_t depth = 0; depth < nest.loops.size(); ++depth) {
      Cover cover = result.back();
      if (is_opaque) {
        cover[static_cast<size_t>(nest.loops[depth].iterator)] = 1;
      } else {
        cover = covers_.inside(run.id, static_cast<int>(depth));
        for (size_t i = 0; i < cover.size(); ++i) cover[i] = std::min(cover[i], extents[i]);
      }
      // All lanes run at once, whatever loops are inside of theirs.
      if (run.nest.lanes.iterator >= 0 && run.nest.lanes.depth <= static_cast<int>(depth))
        cover_lanes(run.nest.lanes, cover);
      result.push_back(std::move(cover));
    }
    return result;
  }
};

// The largest share of the blocks along a dimension of `run` that a border cuts, for one that reads it in its loops.
double cut_share(const StageRun& reader, const TouchedSide& side, const StageRun& run) {
  double share = 0;
  for (const TouchedSide::Move& move : side.moves) {
    const auto i = static_cast<size_t>(move.iterator);
    const double blocks =
        std::ceil(double(reader.cover[0][i]) / double(reader.cover[run.place][i]));
    if (side.is_clamped && blocks > 1) share = std::max(share, std::min(1.0, 2 / blocks));
    if (reader.id.stage == 0 && i < reader.cut.size()) share = std::max(share, reader.cut[i]);
  }
  return share;
}

// A read that is clamped needs less than a whole box in the first and the last block of a row, and so does what that box
// is computed from. Readers come after what they read.
void find_cuts(const SizeModel& sizes, Group& group) {
  for (size_t r = group.runs.size(); r-- > 0;) {
    StageRun& run = group.runs[r];
    if (run.place <= 1) continue;
    run.cut.assign(sizes.graph().func(run.id.func).func->args.size(), 0);
    for (const StageRun& reader : group.runs) {
      if (reader.cover.size() <= run.place || reader.id.func == run.id.func) continue;
      for (const Touch& touch : reader.facts->touches) {
        if (touch.buffer != run.id.func) continue;
        for (size_t d = 0; d < run.cut.size(); ++d)
          run.cut[d] = std::max(run.cut[d], cut_share(reader, touch.sides[d], run));
      }
    }
  }
}

}  // namespace

Group group_of(const Plan& plan, const PlannedGroup& planned, Covers& covers,
               const SizeModel& sizes, const Machine& machine, FactsOfStages& facts) {
  Group group = GroupBuilder(plan, covers, sizes, machine, facts).build(planned);
  find_cuts(sizes, group);
  return group;
}

}  // namespace retrograde::planning
