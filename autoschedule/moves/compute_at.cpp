// compute_at -- a Func is computed and stored in a loop of a stage that reads it.
//
//   out   root  y:8, x:16, y, vector x         blur  root  y, x:16, vector x
//   =>    blur  at out/y:8   y, x:16, vector x
//         blur  at out/x:16  y, vector-sized rows
//
//   =>    scan  at out/y:8   y, x:16, vector x;  y, r.x
//
// Legal: L3: the loop is around all reads, also through inlined Funcs, and what data decides has a range; L5; L8. Along
// dimensions that a reduction moves, all that updates access is computed each time.
// Method: the loops around the first read, of which any legal one is one. For each of the registers and the caches the
// outermost loop in which the elements that are needed fit.
#include <algorithm>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"
#include "autoschedule/plan/readers.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_levels = 3;

class LevelFinder {
 public:
  LevelFinder(const Plan& plan, FuncId func, const Context& context)
      : plan_(plan), func_(func), context_(context), readers_(plan), covers_(plan, context.sizes) {}

  struct Place {
    Level level;
    std::vector<int64_t> box;
  };
  // Innermost first.
  std::vector<Place> run() {
    std::vector<Place> places;
    const std::vector<StageId> readers = all_readers(plan_, context_, func_);
    const auto reader = std::ranges::find_if(
        readers, [&](StageId stage) { return !is_inlined(plan_, stage.func); });
    if (reader == readers.end()) return places;
    const std::vector<Level> levels = levels_of(*reader);
    for (const double bytes : sizes_of_memories()) {
      std::optional<Place> outermost;
      for (const Level& level : levels) {
        if (!encloses_reads(level)) continue;
        const std::vector<int64_t> box = covers_.box(func_, level);
        if (bytes_of(box) <= bytes && is_worth(level, box)) outermost = {level, box};
      }
      const auto is_it = [&](const Place& place) { return place.level == outermost->level; };
      if (outermost && std::ranges::none_of(places, is_it)) places.push_back(*outermost);
    }
    if (places.size() > most_levels) places.resize(most_levels);
    return places;
  }

 private:
  const Plan& plan_;
  const FuncId func_;
  const Context& context_;
  const Readers readers_;
  Covers covers_;

  std::vector<double> sizes_of_memories() const {
    std::vector<double> bytes{static_cast<double>(context_.machine.accumulator_bytes())};
    for (size_t l = 0; l <= Machine::last_cache; ++l)
      bytes.push_back(context_.machine.levels[l].bytes);
    return bytes;
  }

  // The loops around a stage, innermost first; loops of its body and those that it shares are none.
  std::vector<Level> levels_of(StageId stage) const {
    std::vector<Level> levels;
    int depth = INT16_MAX;
    while (is_editable(plan_, stage.func)) {
      depth = std::min<int>(depth, static_cast<int>(body_depth(plan_.nest(stage))) - 1);
      const std::optional<LoopRef>& shared = plan_.nest(stage).shared_with;
      const int last = shared ? shared->depth + 1 : 0;
      for (; depth >= last; --depth) {
        Level level{Level::Kind::At, {stage, static_cast<int16_t>(depth)}};
        levels.push_back(level);
      }
      const Level& outer = plan_.of(stage.func).placement.compute;
      if (shared || outer.kind != Level::Kind::At) break;
      stage = outer.loop.stage;
      depth = outer.loop.depth;
    }
    return levels;
  }

  bool encloses_reads(const Level& level) const { return !readers_.find_outside(func_, level); }

  double bytes_of(const std::vector<int64_t>& box) const {
    double bytes = product_of(box);
    for (const Type& type : context_.accesses.func(func_).func->types) bytes *= type.bytes();
    return bytes;
  }
  // L5: how often an element is computed.
  bool is_worth(const Level& level, const std::vector<int64_t>& box) const {
    double all = 1;
    for (size_t d = 0; d < box.size(); ++d)
      all *= static_cast<double>(std::max<int64_t>(context_.sizes.of(func_, d).estimate, 1));
    return computed_elements(plan_, context_, level, box) <= most_recomputation * all;
  }
};

}  // namespace

std::vector<Plan> compute_at(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!may_run_in_loops(plan, context, func)) return plans;
  for (const auto& [level, box] : LevelFinder(plan, func, context).run())
    add_placed(plans, plan, func, {level, {}, {}}, box, context);
  return plans;
}

}  // namespace retrograde::planning::moves
