// slide -- a Func is computed at each row of its consumer and stored for a strip of rows: an iteration computes only the rows
// that those before it in the strip have not.
//
//   out   root  parallel c, parallel y, x:16, vector x
//   blur  root  parallel y, x:16, vector x
//   =>
//   out   root  parallel y:64, y, c, x:16, vector x
//   blur  at out/y  store at out/y:64   y, x:16, vector x
//
// Legal: L3, L8, and of the consumer L1; L9: a consumer in whose loops another Func has a window has its strips already;
// L11: all stages that share the loops of rows get the strips.
// Method: rows go along the outermost dimension of the consumer in which rows overlap or, without one, along the
// innermost that moves the Func. Strips are as high as enough tasks for each thread allow, and as wide as rows: each end of
// a row in a tile takes long. A dimension of few values runs inside of a row if all of them share it.
#include <algorithm>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"

namespace retrograde::planning::moves {

namespace {

constexpr int64_t few_values = 4;

// The stage at root in whose loops all stages run that the first consumer of a Func is computed in.
std::optional<StageId> stage_around_reads(const Plan& plan, const Context& context, FuncId func) {
  const std::vector<StageId> readers = all_readers(plan, context, func);
  const auto first =
      std::ranges::find_if(readers, [&](StageId stage) { return !is_inlined(plan, stage.func); });
  if (first == readers.end()) return std::nullopt;
  StageId stage = *first;
  while (plan.of(stage.func).placement.compute.kind == Level::Kind::At)
    stage = plan.of(stage.func).placement.compute.loop.stage;
  while (plan.nest(stage).shared_with) stage = plan.nest(stage).shared_with->stage;
  return has_loops(plan, stage.func) ? std::optional(stage) : std::nullopt;
}

// The loops of a stage at root, with one of them as a loop over the rows of a strip.
class StripFinder {
 public:
  StripFinder(const Plan& plan, StageId host, const Context& context)
      : plan_(plan),
        host_(host),
        context_(context),
        nest_(plan.nest(host)),
        extents_(whole_cover(host, context.sizes)) {
    const std::optional<size_t> lanes = vector_loop(nest_);
    if (lanes) lane_ = nest_.loops[*lanes].iterator;
  }

  struct Strip {
    Plan plan;
    size_t row = 0;  // the depth of the loop over rows; storage is in the loop around it
  };
  // The strips that are there if they have whole rows, or new ones, inside of whose rows loops over `inside` run. None along
  // the iterator of the lanes: a row would be a vector.
  std::optional<Strip> along(int iterator, IteratorSet inside) const {
    const std::optional<size_t> row = row_of(nest_, iterator);
    if (lane_ == iterator || !row) return std::nullopt;
    const auto outside = nest_.loops.begin() + static_cast<std::ptrdiff_t>(*row);
    const bool are_whole =
        std::ranges::find(nest_.loops.begin(), outside, lane_, &Loop::iterator) == outside;
    const bool are_there = outer_step(nest_, iterator, nest_.loops[*row].step) > 0;
    if (are_there && are_whole) return Strip{plan_, *row};
    return shared_loops(plan_, host_) == 0 ? new_strip(iterator, inside) : shared_strip(*row);
  }
  // The iterators that have few values.
  std::vector<int> short_loops() const {
    std::vector<int> found;
    const Nest plain = without_tiles();
    for (size_t d = 0; d < body_depth(plain); ++d)
      if (trips(extents_, plain, d) <= few_values) found.push_back(plain.loops[d].iterator);
    return found;
  }

 private:
  const Plan& plan_;
  const StageId host_;
  const Context& context_;
  const Nest& nest_;
  const Cover extents_;
  int lane_ = once;  // the iterator of the lanes

  // The innermost loop of an iterator around the body.
  static std::optional<size_t> row_of(const Nest& nest, int iterator) {
    for (size_t d = body_depth(nest); d-- > 0;)
      if (nest.loops[d].iterator == iterator) return d;
    return std::nullopt;
  }
  // One loop for each iterator, and the body.
  Nest without_tiles() const {
    Nest nest = nest_;
    for (size_t d = body_depth(nest); d-- > 0;) {
      const Loop& loop = nest.loops[d];
      if (outer_step(nest, loop.iterator, loop.step) > 0) drop_loop(nest, d);
    }
    return nest;
  }

  // The height of as many strips as keep all threads busy, beside the iterations of the loops around.
  int64_t strip_height(int64_t tasks, int64_t rows) const {
    const int64_t enough = context_.machine.enough_tasks();
    int64_t strips = (enough + tasks - 1) / tasks;
    while (strips * tasks % context_.machine.threads != 0) ++strips;  // no thread waits
    return (rows + strips - 1) / strips;
  }

  // Loops that stages share stay, and all of these stages get the strips.
  std::optional<Strip> shared_strip(size_t row) const {
    int64_t tasks = 1;
    for (size_t d = 0; d <= row; ++d) {
      if (row >= shared_loops(plan_, host_) || !may_run_at_once(context_, host_, nest_, d))
        return std::nullopt;
      if (d < row) tasks *= trips(extents_, nest_, d);
    }
    const Loop& rows = nest_.loops[row];
    const int64_t height = strip_height(tasks, trips(extents_, nest_, row)) * rows.step;
    if (height <= rows.step || nest_.loops[0].kind != ForType::Parallel) return std::nullopt;
    std::optional<Plan> plan = with_strips(plan_, {host_, static_cast<int16_t>(row)}, height);
    return plan ? std::optional(Strip{std::move(*plan), row + 1}) : std::nullopt;
  }

  // Outside of the strips are the loops that are outside of the rows, without those of the lanes and those over `within`.
  std::optional<Strip> new_strip(int iterator, IteratorSet within) const {
    const Nest plain = without_tiles();
    const size_t at = *row_of(plain, iterator);
    Nest nest = plain;
    std::vector<Loop> outside, inside;
    const int64_t enough = context_.machine.enough_tasks();
    int64_t tasks = 1;
    for (size_t d = 0; d < plain.loops.size(); ++d) {
      if (d < at && !may_run_at_once(context_, host_, plain, d)) return std::nullopt;
      const int64_t count = trips(extents_, plain, d);
      const int i = plain.loops[d].iterator;
      const bool is_around = d < at && count > 1 && i != lane_ && !(within & set_of(i));
      if (is_around) tasks = std::min(tasks * count, enough);
      if (d != at) (is_around ? outside : inside).push_back(plain.loops[d]);
    }
    const Loop& rows = plain.loops[at];
    const int64_t height = strip_height(tasks, trips(extents_, plain, at)) * rows.step;
    nest.loops = outside;
    nest.loops.push_back(rows);
    nest.loops.insert(nest.loops.end(), inside.begin(), inside.end());
    size_t row = outside.size();
    if (height > rows.step && height < extents_[static_cast<size_t>(rows.iterator)])
      insert_step(nest, rows.iterator, height, row++);
    for (size_t d = 0; d < nest.loops.size(); ++d) {
      ForType& kind = nest.loops[d].kind;
      const bool is_body = kind == ForType::Vectorized || kind == ForType::Unrolled;
      if (!is_body) kind = d < row ? ForType::Parallel : ForType::Serial;
    }
    if (row == 0 || !may_run_at_once(context_, host_, nest, row - 1)) return std::nullopt;
    FuncPlan changed = plan_.of(host_.func);
    changed.nests[static_cast<size_t>(host_.stage)] = std::move(nest);
    std::optional<Plan> plan = with_func(plan_, host_.func, std::move(changed), context_);
    return plan ? std::optional(Strip{std::move(*plan), row}) : std::nullopt;
  }
};

// A strip in which a Func is computed.
struct Window {
  StripFinder::Strip strip;
  Placement placement;
  std::vector<int64_t> box;  // of a row
  bool overlaps = false;     // whether rows share elements
};

std::optional<Window> window_in(StripFinder::Strip strip, StageId host, FuncId func,
                                const Context& context) {
  Window window{std::move(strip), {}, {}};
  const Level row{Level::Kind::At, {host, static_cast<int16_t>(window.strip.row)}};
  Level around = row;
  --around.loop.depth;
  Covers covers(window.strip.plan, context.sizes);
  window.box = covers.box(func, row);
  const std::vector<int64_t> all = covers.box(func, around);
  const int64_t rows =
      trips(whole_cover(host, context.sizes), window.strip.plan.nest(host), window.strip.row);
  int moved = 0;  // dimensions; lowering finds the new elements of a row if there is one
  for (size_t d = 0; d < all.size(); ++d) {
    moved += window.box[d] < all[d];
    window.overlaps |= window.box[d] < all[d] && all[d] < rows * window.box[d];
  }
  window.placement.compute = row;
  if (window.overlaps) window.placement.store = around;
  return moved == 1 || (moved > 0 && !window.overlaps) ? std::optional(std::move(window))
                                                       : std::nullopt;
}

}  // namespace

std::vector<Plan> slide(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!may_run_in_loops(plan, context, func) || !stays_in_place(context, func)) return plans;
  const std::optional<StageId> host = stage_around_reads(plan, context, func);
  if (!host || host->func == func) return plans;
  const StripFinder strips(plan, *host, context);
  std::optional<Window> best;
  const std::vector<Iterator>& iterators = context.accesses.stage(*host).iterators;
  const std::vector<int16_t>& order = plan.of(host->func).storage.order;
  for (const int16_t dimension : order) {  // the innermost first
    const auto i = std::ranges::find(iterators, dimension, &Iterator::dimension);
    if (i == iterators.end()) continue;
    const auto window_along = [&](IteratorSet inside) {
      auto strip = strips.along(static_cast<int>(i - iterators.begin()), inside);
      return strip ? window_in(std::move(*strip), *host, func, context) : std::nullopt;
    };
    IteratorSet inside = 0;
    auto window = window_along(inside);
    for (const int other : strips.short_loops()) {
      auto shared = window_along(inside | set_of(other));
      if (!shared || (window && product_of(shared->box) > product_of(window->box))) continue;
      window = std::move(shared);
      inside |= set_of(other);
    }
    if (window && (!best || window->overlaps)) best = std::move(window);
  }
  if (best) add_placed(plans, best->strip.plan, func, best->placement, best->box, context);
  return plans;
}

}  // namespace retrograde::planning::moves
