// fuse_readers -- the stages that read a Func run in the same loops over its rows, and it is computed in these loops.
//
//   adj   root  y, x:16, vector x                        adj   root  y, x:16, vector x
//   sums  root                                     =>    sums  root
//     .1  lanes:16, rows, r.x, vector lanes                .1  shared with adj/y  rows, lanes:16, r.x, vector lanes
//   f     root  y, x:16, vector x                        f     at adj/y  y, x:16, vector x
//
// A row of f is read by all of them while it is near, and what else they read in common is loaded once. Where a sum has
// copies for strips of rows, the loops are those over strips and over the rows of a strip.
//
// Legal: L1, L6: loops over rows are pure loops of each stage, so that they may be outermost and parallel; L3; L5: a row is
// computed once for each distance at which it is read; L11: the loops that are shared get equal steps; none of the stages
// depends on another one.
#include <algorithm>
#include <map>

#include "autoschedule/moves/edit.h"
#include "autoschedule/plan/covers.h"

namespace retrograde::planning::moves {

namespace {

constexpr size_t most_dimensions = 2;

// A coordinate as a sum of iterators, or of dimensions of a Func, with coefficients.
using Coordinate = std::map<int, int64_t>;

// How one dimension of a Func follows the loops of the stages that read it.
class RowReads {
 public:
  RowReads(const Plan& plan, const Context& context, FuncId func, int dimension)
      : plan_(plan), context_(context), func_(func), dimension_(dimension) {}

  // By iterators of the stage; nullopt: reads differ, or are not affine. Empty: nothing in the stage reads the Func.
  std::optional<Coordinate> of(StageId stage) {
    Coordinate all;
    for (const Access& read : context_.accesses.stage(stage).reads) {
      if (read.of < 0 || read.of == stage.func) continue;
      const std::optional<Coordinate> inside = of_func(read.of);
      if (!inside) return std::nullopt;
      Coordinate own;
      for (const auto& [d, coefficient] : *inside) {
        const IndexForm& form = read.index[static_cast<size_t>(d)];
        if (form.divisor != 1 || form.modulus != 0 || !form.opaque.empty()) return std::nullopt;
        for (const Term& term : form.terms) own[term.iterator] += coefficient * term.coefficient;
      }
      if (inside->empty() || own == all) continue;
      if (!all.empty()) return std::nullopt;
      all = std::move(own);
    }
    return all;
  }

 private:
  const Plan& plan_;
  const Context& context_;
  const FuncId func_;
  const int dimension_;
  std::map<FuncId, std::optional<Coordinate>> known_;

  // By dimensions of a Func that is computed with its reader.
  std::optional<Coordinate> of_func(FuncId id) {
    if (id == func_) return Coordinate{{dimension_, 1}};
    const bool is_inside =
        is_inlined(plan_, id) || plan_.of(id).placement.compute.kind == Level::Kind::At;
    if (!is_inside) return Coordinate{};
    const auto [known, is_new] = known_.try_emplace(id);
    if (is_new) known->second = of_stages(id);
    return known->second;
  }
  std::optional<Coordinate> of_stages(FuncId id) {
    Coordinate all;
    for (const StageNode& stage : context_.accesses.func(id).stages) {
      const std::optional<Coordinate> own = of(stage.id);
      if (!own) return std::nullopt;
      Coordinate by_dimension;
      for (const auto& [i, coefficient] : *own) {
        if (is_reduction(context_, stage.id, i)) return std::nullopt;
        by_dimension[stage.iterators[static_cast<size_t>(i)].dimension] = coefficient;
      }
      if (by_dimension.empty() || by_dimension == all) continue;
      if (!all.empty()) return std::nullopt;
      all = std::move(by_dimension);
    }
    return all;
  }
};

class ReaderFusion {
 public:
  ReaderFusion(const Plan& plan, FuncId func, const Context& context)
      : plan_(plan), func_(func), context_(context) {}

  // The stages at root in whose loops the Func is read; the one that owns the loops last.
  bool find_stages() {
    for (StageId stage : all_readers(plan_, context_, func_)) {
      if (is_inlined(plan_, stage.func)) continue;
      while (plan_.of(stage.func).placement.compute.kind == Level::Kind::At) {
        if (plan_.of(stage.func).placement.compute.in_each_stage) return false;
        stage = plan_.of(stage.func).placement.compute.loop.stage;
      }
      if (!has_loops(plan_, stage.func)) return false;
      if (std::ranges::find(stages_, stage) == stages_.end()) stages_.push_back(stage);
    }
    const auto rank = [&](StageId stage) {
      return std::pair(has_guests(stage), context_.accesses.func(stage.func).stages.size() == 1);
    };
    std::ranges::stable_sort(stages_, {}, rank);
    if (stages_.size() < 2) return false;
    return std::ranges::none_of(stages_, [&](StageId stage) { return is_bound(stage); });
  }

  std::optional<Plan> run(int dimension) {
    rows_.clear();
    RowReads reads(plan_, context_, func_, dimension);
    for (const StageId stage : stages_) {
      const std::optional<Coordinate> rows = reads.of(stage);
      if (!rows || !note_rows(stage, *rows)) return std::nullopt;
    }
    Plan plan = plan_;
    if (!find_strip()) return std::nullopt;
    const LoopRef inside{stages_.back(), static_cast<int16_t>(strip_ > 1 ? 1 : 0)};
    for (size_t s = stages_.size(); s-- > 0;) {
      const StageId stage = stages_[s];
      FuncPlan changed = plan.of(stage.func);
      Nest& nest = changed.nests[static_cast<size_t>(stage.stage)];
      if (!run_over_rows(nest, rows_[s])) return std::nullopt;
      nest.shared_with.reset();
      if (stage != stages_.back()) nest.shared_with = inside;
      if (!change(plan, stage.func, std::move(changed))) return std::nullopt;
    }
    if (!place(plan, inside)) return std::nullopt;
    return plan;
  }

 private:
  const Plan& plan_;
  const FuncId func_;
  const Context& context_;
  std::vector<StageId> stages_;
  std::vector<std::vector<int>> rows_;  // by stage: iterators over strips and rows, or over rows
  std::vector<int64_t> steps_;          // of strips, in all stages that have them
  int64_t strip_ = 1;                   // rows

  bool change(Plan& plan, FuncId func, FuncPlan changed) const {
    if (changed == plan.of(func)) return true;
    std::optional<Plan> next = with_func(plan, func, std::move(changed), context_);
    if (next) plan = std::move(*next);
    return next.has_value();
  }

  bool place(Plan& plan, const LoopRef& inside) const {
    FuncPlan changed = plan.of(func_);
    changed.placement = {};
    changed.placement.compute = {Level::Kind::At, inside};
    changed.storage.folds.clear();
    const std::vector<int64_t> box =
        Covers(plan, context_.sizes).box(func_, changed.placement.compute);
    run_along_rows(changed, plan, context_, func_, box, lanes_for(plan, {func_, 0}, INT64_MAX) / 2);
    return change(plan, func_, std::move(changed));
  }

  // Whether other Funcs share loops of the stage.
  bool has_guests(StageId stage) const {
    for (size_t f = 0; f < plan_.funcs.size(); ++f) {
      for (const Nest& nest : plan_.funcs[f]->nests) {
        const bool is_other = static_cast<FuncId>(f) != stage.func;
        if (is_other && nest.shared_with && nest.shared_with->stage == stage) return true;
      }
    }
    return false;
  }
  // Whether it shares loops with others than the stage that owns the loops, or another stage of its Func reads the Func.
  bool is_bound(StageId stage) const {
    const std::optional<LoopRef>& shared = plan_.nest(stage).shared_with;
    const bool is_elsewhere =
        shared && shared->stage.func != stage.func && shared->stage != stages_.back();
    return is_elsewhere || (stage != stages_.back() && has_guests(stage)) ||
           std::ranges::count(stages_, stage.func, &StageId::func) > 1;
  }
  int64_t points(StageId stage, int iterator) const {
    return context_.sizes.of(stage, iterator).estimate;
  }
  bool note_rows(StageId stage, const Coordinate& rows) {
    std::vector<std::pair<int64_t, int>> sorted;
    for (const auto& [i, coefficient] : rows) {
      if (is_reduction(context_, stage, i)) return false;
      sorted.emplace_back(-coefficient, i);
    }
    std::ranges::sort(sorted);
    if (sorted.empty() || sorted.size() > 2 || sorted.back().first != -1) return false;
    rows_.emplace_back();
    for (const auto& [coefficient, i] : sorted) rows_.back().push_back(i);
    const int64_t step = outer_step(plan_.nest(stage), sorted[0].second, 1);
    if (sorted.size() == 2) steps_.push_back(-sorted[0].first);
    if (sorted.size() == 1 && step > 0) steps_.push_back(step);
    return true;
  }
  // Whether all stages have as many strips and rows.
  bool find_strip() {
    strip_ = steps_.empty() ? 1 : steps_[0];
    steps_.push_back(strip_);
    if (std::ranges::count(steps_, strip_) != static_cast<int64_t>(steps_.size())) return false;
    steps_.clear();
    std::optional<int64_t> strips;
    for (size_t s = 0; s < stages_.size(); ++s) {
      const int64_t first = points(stages_[s], rows_[s][0]);
      const bool has_strips = rows_[s].size() == 2;
      if (has_strips && points(stages_[s], rows_[s][1]) != strip_) return false;
      const int64_t own = has_strips ? first : (first + strip_ - 1) / strip_;
      if (own < 2 || strips.value_or(own) != own) return false;
      strips = own;
    }
    return true;
  }

  bool run_over_rows(Nest& nest, const std::vector<int>& rows) const {
    for (Loop& loop : nest.loops) {
      if (loop.kind == ForType::Parallel) loop.kind = ForType::Serial;
    }
    const auto move_out = [&](size_t depth) {
      const auto loop = nest.loops.begin() + static_cast<std::ptrdiff_t>(depth);
      std::rotate(nest.loops.begin(), loop, loop + 1);
    };
    const int64_t strip = outer_step(nest, rows[0], 1);
    for (size_t i = rows.size(); i-- > 0;) {
      const size_t depth = innermost_loop(nest, rows[i]);
      if (depth >= body_depth(nest) || (i > 0 && outer_step(nest, rows[i], 1) > 0)) return false;
      move_out(depth);
    }
    const bool has_strips = rows.size() == 2 || strip_ == 1;
    if (strip > 0 && (has_strips || strip != strip_ || outer_step(nest, rows[0], strip) > 0))
      return false;
    if (strip > 0) move_out(*find_loop(nest, rows[0], strip));
    if (strip == 0 && !has_strips) insert_step(nest, rows[0], strip_, 0);
    if (context_.machine.threads > 1) nest.loops[0].kind = ForType::Parallel;
    return true;
  }
};

// The plan in which stages that read the Func, but run in loops of others, are at root. There, rows may be their pure loops,
// where the others add up what all rows give.
Plan with_readers_apart(Plan plan, FuncId func, const Context& context) {
  for (const StageId stage : all_readers(plan, context, func)) {
    if (plan.of(stage.func).placement.compute.kind != Level::Kind::At) continue;
    std::vector<Plan> apart = find_move("root")->apply(plan, stage.func, context);
    if (!apart.empty()) plan = std::move(apart.front());
  }
  return plan;
}

}  // namespace

std::vector<Plan> fuse_readers(const Plan& plan, FuncId func, const Context& context) {
  std::vector<Plan> plans;
  if (!is_editable(plan, func) || context.accesses.func(func).stages.size() > 1 ||
      is_output(*plan.program, func) || !has_bounded_region(plan, context, func))
    return plans;
  const std::vector<int16_t>& order = plan.of(func).storage.order;
  if (order.size() < 2) return plans;
  const auto add_fusions = [&](const Plan& from) {
    ReaderFusion fusion(from, func, context);
    if (!fusion.find_stages()) return;
    for (size_t d = order.size(); d-- > 1 && plans.size() < most_dimensions;)
      add(plans, fusion.run(order[d]));
  };
  add_fusions(plan);
  if (plans.empty()) add_fusions(with_readers_apart(plan, func, context));
  return plans;
}

}  // namespace retrograde::planning::moves
