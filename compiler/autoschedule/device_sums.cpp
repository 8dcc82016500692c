#include "autoschedule/device_sums.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <utility>

#include "autoschedule/kernel_limits.h"
#include "autoschedule/new_loop.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/race_checks.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t terms_of_part = 16;  // of a partial sum, for each of its elements
constexpr int64_t least_parts = 8;
constexpr int64_t unknown_terms = 1 << 14;  // of a loop
constexpr int64_t most_terms = 1 << 30;     // that one loop counts

class SumCutter {
 public:
  SumCutter(const FuncPtr& f, int stage, std::vector<StageLoop> loops, const SizeEstimate& sizes,
            const planning::Device& device)
      : f_(f),
        index_(stage),
        sizes_(sizes),
        device_(device),
        loops_(std::move(loops)),
        commutes_(graph::can_prove_commutative(*f, f->stage(stage))) {}

  // 0: it is no such sum.
  int64_t parts() const {
    const int64_t alone = independent_elements(), terms = this->terms();
    if (alone == 0 || alone >= device_.few_threads() || terms < device_.launch_terms) return 0;
    const int64_t elements = elements_that_meet();
    if (elements == 0) return 0;
    const int64_t most = std::min(
        {device_.enough_threads() / alone, terms / (terms_of_part * elements), terms_in_parts()});
    if (most < least_parts || (!commutes_ && !keeps_order())) return 0;
    return static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(most)));
  }

  // The partial sums, those of their sums too.
  std::vector<FuncPtr> cut(int64_t count) const {
    Stage stage(f_, index_);
    const std::vector<StageLoop> one = fused(summed());
    RVar all(one[0].loop.name());
    for (size_t i = 1; i < one.size(); ++i) {
      const RVar both(new_loop(*f_, index_, "terms"));
      stage.fuse(all, one[i].loop, both);
      all = both;
    }
    if (has_rows()) return cut_rows(stage, all, RVar(summed()[one.size()].loop.name()), count);
    const RVar part = split(stage, all, "part", terms(), count);
    std::vector<FuncPtr> made{factor(stage, {part})};
    if (count >= device_.launch_terms)
      made.push_back(factor(stage, {split(stage, part, "group", count, device_.block_threads())}));
    return made;
  }

 private:
  const Definition& update() const { return f_->stage(index_); }

  // Whether parts may be stretches of the domain: those of an argmin, of which the first of equals
  // is wanted.
  bool keeps_order() const {
    const bool is_one_loop = std::ranges::all_of(loops_, [](const StageLoop& loop) {
      return !loop.loop.is_rvar || (!loop.is_independent && loop.extent);
    });
    return is_one_loop && fused(summed()).size() == summed().size() &&
           graph::prove_associative(*f_, update()).op;
  }

  std::vector<StageLoop> summed() const {
    std::vector<StageLoop> result;
    std::ranges::copy_if(loops_, std::back_inserter(result),
                         [](const StageLoop& loop) { return !loop.is_independent; });
    return result;
  }

  // Loops from the innermost on that are one, of a number that 32 bits count: all but the last of
  // known extents, or nothing would be known of the places that they stand for.
  static std::vector<StageLoop> fused(const std::vector<StageLoop>& loops) {
    std::vector<StageLoop> result;
    int64_t product = 1;
    for (const StageLoop& loop : loops) {
      product *= std::max<int64_t>(loop.extent.value_or(unknown_terms), 1);
      if (!result.empty() && (product > most_terms || !result.back().extent)) break;
      result.push_back(loop);
    }
    return result;
  }
  // Whether parts are of two loops: one may be short.
  bool has_rows() const {
    const std::vector<StageLoop> one = fused(summed());
    return commutes_ && one.size() < summed().size() && !one.back().extent;
  }

  static int64_t product_of(const std::vector<StageLoop>& loops) {
    int64_t product = 1;
    for (const StageLoop& loop : loops)
      product =
          std::min(product * std::max<int64_t>(loop.extent.value_or(unknown_terms), 0), most_terms);
    return product;
  }
  int64_t terms() const { return summed().empty() ? 0 : product_of(summed()); }
  int64_t terms_in_parts() const { return has_rows() ? terms() : product_of(fused(summed())); }

  // 0: they may be many.
  int64_t independent_elements() const {
    int64_t elements = 1;
    for (const StageLoop& loop : loops_) {
      if (!loop.is_independent) continue;
      if (!loop.extent) return 0;
      elements *= *loop.extent;
      if (elements >= device_.few_threads()) return 0;
    }
    return elements;
  }

  // Of a part: those among which data or the loops of the sum choose. 0: not known.
  int64_t elements_that_meet() const {
    int64_t elements = 1;
    for (size_t d = 0; d < f_->args.size(); ++d) {
      const Expr& place = update().args[d];
      if (is_const(place) || is_pure_position(*f_, update(), d)) continue;
      elements *= sizes_.extent(*f_, d).value_or(0);
      if (elements == 0 || elements > device_.enough_threads() * terms_of_part) return 0;
    }
    return elements;
  }

  // Sums of every so many points of every so many rows, and then of all rows.
  std::vector<FuncPtr> cut_rows(Stage& stage, const RVar& all, const RVar& rows,
                                int64_t count) const {
    const int64_t points = std::min<int64_t>(count, device_.block_threads());
    const RVar part = split(stage, all, "part", unknown_terms, points);
    if (count == points) return {factor(stage, {part})};
    const RVar row = split(stage, rows, "row", unknown_terms, count / points);
    const FuncPtr first = factor(stage, {part, row});
    return {first, factor(stage, {part})};
  }

  // Into so many parts: of every so many terms one, where neighbours may read neighbours; else a
  // stretch for each. The result: the loop over parts.
  RVar split(Stage& stage, const RVar& all, const std::string& name, int64_t terms,
             int64_t count) const {
    const RVar part(new_loop(*f_, index_, name));
    if (commutes_)
      stage.split(all, all, part, static_cast<int>(count), TailStrategy::GuardWithIf);
    else
      stage.split(all, part, all, static_cast<int>((terms + count - 1) / count),
                  TailStrategy::GuardWithIf);
    return part;
  }

  // Partial results for each value of these loops, which lie beside each other.
  FuncPtr factor(Stage& stage, const std::vector<RVar>& loops) const {
    std::vector<std::pair<RVar, Var>> kept;
    std::vector<Var> layout;
    for (const RVar& loop : loops) {
      layout.emplace_back(new_loop(*f_, index_, loop.name() + "s"));
      kept.emplace_back(loop, layout.back());
    }
    Func parts = stage.rfactor(kept);
    for (const Var& arg : parts.args()) {
      if (std::ranges::find(layout, arg.name(), &Var::name) == layout.end()) layout.push_back(arg);
    }
    parts.compute_root();
    if (layout.size() > 1) parts.reorder_storage(layout);
    return parts.function();
  }

  const FuncPtr f_;
  const int index_;
  const SizeEstimate& sizes_;
  const planning::Device& device_;
  const std::vector<StageLoop> loops_;
  const bool commutes_;
};

}  // namespace

std::vector<FuncPtr> cut_sums_for_device(const std::vector<FuncPtr>& funcs,
                                         const std::vector<FuncPtr>& stored,
                                         const ScheduleRequest& request,
                                         const SizeEstimate& sizes) {
  std::vector<FuncPtr> made;
  for (const FuncPtr& f : funcs) {
    for (int s = 1; s < f->stage_count(); ++s) {
      if (f->stage(s).rvars.empty() || !can_be_kernel(f, s, stored)) continue;
      const std::vector<StageLoop> loops = loops_of_stage(*f, s, sizes);
      const bool scatters = iterations_may_meet(*f, s, loops);
      const Decision decision = scatters ? Decision::ScatterStrategy : Decision::CutReductions;
      if (!request.makes(decision)) continue;
      if (scatters && may_be_atomic(*f, s, request)) continue;
      const SumCutter cutter(f, s, loops, sizes, request.device);
      if (const int64_t parts = cutter.parts(); parts > 0) {
        const std::vector<FuncPtr> more = cutter.cut(parts);
        made.insert(made.end(), more.begin(), more.end());
      }
    }
  }
  return made;
}

bool iterations_may_meet(const FuncContents& f, int stage, const std::vector<StageLoop>& loops) {
  const Definition& update = f.stage(stage);
  bool moves = false;
  for (size_t d = 0; d < f.args.size(); ++d)
    moves = moves || (!is_const(update.args[d]) && !is_pure_position(f, update, d));
  return moves &&
         std::ranges::any_of(loops, [](const StageLoop& loop) { return !loop.is_independent; });
}

// Sums, products, extremes and bits of integers are the same in any order.
bool may_be_atomic(const FuncContents& f, int stage, const ScheduleRequest& request) {
  if (!request.makes(Decision::ScatterStrategy) || f.types.size() != 1) return false;
  const Type type = f.types[0];
  const bool keeps_bits = type.is_int() || type.is_uint();
  const bool has_operation = type.is_scalar() && (type.bits() == 32 || type.bits() == 64);
  if (!has_operation || (!keeps_bits && request.options.deterministic)) return false;
  return !graph::read_of_other_element(f, f.stage(stage)).defined() &&
         graph::can_prove_commutative(f, f.stage(stage));
}

}  // namespace retrograde::autoschedule
