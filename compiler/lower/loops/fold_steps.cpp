// fold_steps -- store only the steps of a loop over time that are still read.
// In:  Loops; names unique; storage sized for all steps.
// Out: Loops; names unique; the same value in every element that is read.
//
//   realize u [0, w], [0, n + 1] {               realize u [0, w], [0, n + 1] fold 2 {
//     for t, x: u(x, t) = start(x)                 for (i, 0, 2): for x: u(x, i - 1) = start(x)
//     for (r, 0, n) {                        =>    for (r, 0, n) {
//       for x: u(x, r + 1) = g(u(.., r))             for x: u(x, r + 1) = g(u(.., r))
//     }                                            }
//     last(x) = u(x, n)                            last(x) = u(x, n)
//   }                                            }
//
// The pattern is that of loops over time in both directions: the adjoint of such a loop is another one. If the values
// before the steps depend on the time, or a step adds to them, the stages before the steps run for one slice at a time,
// right before the step that stores the slice.
//
// Method: time_steps.h finds the steps and proves how many consecutive slices are alive at once. Their storage is that
//         of a folded dimension, indexed modulo this number. If all slices stay alive and are large, only the stages
//         before the steps move, so that each slice is in the cache when its step stores it.
// Not done: steps whose last stage is not the loop over time; slices without loops; earlier stages whose loop over time
//         is split or vectorized; in-place steps, which could do with one slice fewer.
// Source: contraction of arrays (Sarkar and Gao, Optimization of array accesses by collective loop transformations,
// ICS 1991). Tests: test/golden/lower/fold_steps/, test/unit/lower/fold_steps_test.cpp.
#include "lower/loops/fold_steps.h"

#include <optional>

#include "autoschedule/machine/reference.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "lower/loops/join_steps.h"
#include "lower/loops/time_steps.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

constexpr int64_t small_bytes =
    2 * planning::first_cache_bytes;  // storage that the nearest caches hold with all steps
constexpr int64_t large_bytes = planning::many_step_bytes;
constexpr int64_t most_slice_bytes =
    planning::largest_second_cache_bytes;  // a slice that stays in the cache until its step
constexpr int64_t most_other_slices = 4;

// The bytes of all slices of a Func; nullopt if unknown.
std::optional<int64_t> bytes_of(const Realize& f, const std::vector<Range>& bounds) {
  int64_t bytes = 0;
  for (const Type& type : f.types) bytes += type.bytes();
  for (const Range& range : bounds) {
    const auto extent = as_const_int(range.extent);
    if (!extent || *extent < 0 || *extent > INT32_MAX || bytes > INT64_MAX / (*extent + 1))
      return std::nullopt;
    bytes *= *extent;
  }
  return bytes;
}

// Runs the earlier stages slice by slice.
class SliceStarter {
 public:
  SliceStarter(const TimeSteps& steps, const FoldStepsRules& rules, FreshNames& fresh)
      : steps_(steps), rules_(rules), fresh_(fresh) {}

  // The earlier stages for the slice `time`. `is_any_slice`: also outside of the region, where their loops do not go.
  Stmt start(const Expr& time, bool is_any_slice = false) const {
    std::vector<Stmt> stages;
    for (const EarlierStage& stage : steps_.earlier)
      stages.push_back(copy_statement(start_of(stage, time, is_any_slice), fresh_));
    return make_block(std::move(stages));
  }

 private:
  const TimeSteps& steps_;
  const FoldStepsRules& rules_;
  FreshNames& fresh_;

  Stmt start_of(const EarlierStage& stage, const Expr& time, bool is_any_slice) const {
    if (!stage.over_time) return make_if(simplify(time == stage.offset), stage.nest);
    const Expr value = simplify((time - stage.offset) * stage.sign);
    const bool in_tasks = has_loops(steps_.loop->body, ForType::Parallel);
    return run_iteration(stage.nest, {stage.over_time, value, !is_any_slice, in_tasks},
                         rules_.is_pure);
  }
};

class FoldSteps : public StatementRewriter {
 public:
  FoldSteps(const Stmt& s, const FoldStepsRules& rules) : rules_(rules), fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* let = s.as<LetStmt>()) {
      lets_[let->name] = substitute(ir::without_lets(let->value), lets_);
      return children(s);
    }
    if (!s.as<Realize>()) return children(s);
    const Stmt inside = children(s);
    const auto& f = *inside.as<Realize>();
    const bool has_folds = !f.layout.folds.empty() || !f.layout.place.empty();
    if (has_folds || !rules_.may_fold(f.name)) return inside;
    const auto steps = find_time_steps(f, lets_);
    if (!steps) return inside;
    const SliceSizes slices = slices_of(f, *steps);
    if (is_worth_folding(slices, *steps)) return folded(f, *steps);
    if (is_worth_joining(slices, *steps)) {
      const Stmt joined = with_consumers(f, *steps);
      if (joined.defined()) return joined;
    }
    return is_worth_moving(slices, *steps) ? moved(f, *steps, slices) : inside;
  }

 private:
  const FoldStepsRules& rules_;
  FreshNames fresh_;
  Substitution lets_;  // with expanded values

  struct SliceSizes {
    Range range;                             // of the time
    std::optional<int64_t> count, of_steps;  // all; those that steps store
    std::optional<int64_t> bytes;            // of all
  };

  SliceSizes slices_of(const Realize& f, const TimeSteps& steps) const {
    std::vector<Range> bounds;
    for (const Range& range : f.bounds) {
      bounds.push_back(
          {simplify(substitute(range.min, lets_)), simplify(substitute(range.extent, lets_))});
    }
    const Range& range = bounds[steps.dimension];
    return {range, as_const_int(range.extent),
            as_const_int(simplify(substitute(steps.loop->extent, lets_))), bytes_of(f, bounds)};
  }

  // ---- few slices ----

  static bool is_worth_folding(const SliceSizes& slices, const TimeSteps& steps) {
    return steps.slots > 0 && slices.count.value_or(steps.slots + 1) > steps.slots &&
           slices.bytes.value_or(small_bytes) >= small_bytes;
  }

  Stmt folded(const Realize& f, const TimeSteps& steps) {
    StorageLayout layout = f.layout;
    layout.folds.resize(f.bounds.size());
    layout.folds[steps.dimension] = make_const(Int(32), steps.slots);
    const SliceStarter starter(steps, rules_, fresh_);
    const For& loop = *steps.loop;
    const Expr slots = make_const(Int(32), steps.slots);
    // A negative number of steps counts as none; then `last` lies further back.
    const Expr end = simplify(loop.min + min(loop.extent, 0));
    const std::string before = fresh_(loop.name);
    const bool is_never = steps.start == SliceStart::Never;
    const Stmt start = starter.start(time_at(steps, end - slots + variable(before)), is_never);
    Stmt stages = make_for(before, 0, slots, ForType::Serial, start);
    Stmt each = is_never ? Stmt() : starter.start(steps.time);
    if (steps.start == SliceStart::FirstSteps)
      each = make_if(variable(loop.name) < loop.min + slots, each);
    return make_realize(f.name, f.types, f.memory, f.bounds, with_stages(f, steps, stages, each),
                        layout);
  }

  // The body with `start` instead of the earlier stages, and with `each` before each step.
  static Stmt with_stages(const Realize& f, const TimeSteps& steps, const Stmt& start,
                          const Stmt& each) {
    return rewrite_statements(f.body, [&](const Stmt& s, auto& all) {
      if (s.get() == steps.stages) return make_block({start, all(steps.stages->stmts.back())});
      if (s.get() != steps.loop) return all.children(s);
      const For& loop = *steps.loop;
      return make_for(loop.name, loop.min, loop.extent, loop.runs, make_block({each, loop.body}),
                      loop.partition);
    });
  }

  // ---- few slices, if the consumers run in the steps ----

  static bool is_worth_joining(const SliceSizes& slices, const TimeSteps& steps) {
    const auto [range, count, of_steps, bytes] = slices;
    return steps.slots == 0 && count && *count > 0 && bytes && *bytes >= large_bytes &&
           *bytes / *count <= most_slice_bytes;
  }

  Stmt with_consumers(const Realize& f, const TimeSteps& steps) {
    const auto consumers = find_step_consumers(f, steps, lets_, rules_.may_fold);
    if (!consumers) return {};
    const Stmt joined = join_steps(f, steps, *consumers, rules_.is_pure);
    const auto& all = *joined.as<Realize>();
    const auto found = find_time_steps(all, lets_);
    return found && is_worth_folding(slices_of(all, *found), *found) ? folded(all, *found) : Stmt();
  }

  // ---- all slices ----

  bool is_worth_moving(const SliceSizes& slices, const TimeSteps& steps) const {
    const auto [range, count, of_steps, bytes] = slices;
    return !steps.earlier.empty() && count && of_steps && bytes && *bytes >= large_bytes &&
           *bytes / *count <= most_slice_bytes && *of_steps < *count &&
           *count - *of_steps <= most_other_slices && is_one_sided(range, steps) &&
           has_loops(steps.loop->body, ForType::Parallel);
  }

  // Whether the slices that no step stores are all before the first one.
  bool is_one_sided(const Range& all, const TimeSteps& steps) const {
    const Expr last = time_at(steps, steps.loop->min + steps.loop->extent - 1);
    const Expr end = steps.sign > 0 ? all.min + all.extent - 1 : all.min;
    return is_zero(simplify(substitute(last, lets_) - end));
  }

  Stmt moved(const Realize& f, const TimeSteps& steps, const SliceSizes& slices) {
    const SliceStarter starter(steps, rules_, fresh_);
    const For& loop = *steps.loop;
    const int64_t others = *slices.count - *slices.of_steps;
    const std::string before = fresh_(loop.name);
    const Expr iteration = loop.min - make_const(Int(32), others) + variable(before);
    const Stmt start = make_for(before, 0, make_const(Int(32), others), ForType::Serial,
                                starter.start(time_at(steps, iteration)));
    return with_body(f, with_stages(f, steps, start, starter.start(steps.time)));
  }
};

}  // namespace

Stmt fold_steps(const Stmt& s, const FoldStepsRules& rules) {
  return s.defined() ? FoldSteps(s, rules)(s) : s;
}

}  // namespace retrograde::lower
