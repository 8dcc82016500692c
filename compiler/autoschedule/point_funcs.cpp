#include "autoschedule/point_funcs.h"

#include <algorithm>
#include <functional>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/long_sums.h"
#include "autoschedule/loop_order.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/scatter_schedule.h"
#include "autoschedule/stored_reads.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t most_numbers = 16;      // of a point
constexpr int64_t vectors_of_points = 4;  // at least
constexpr double worth_turning = 0.7;     // of the time of vectors along the first dimension
constexpr double unknown_terms = 16;
constexpr int64_t small_stride = 4;

bool is_result_of(const std::vector<FuncPtr>& outputs, const FuncContents& f) {
  return std::ranges::any_of(outputs, [&](const FuncPtr& o) { return o.get() == &f; });
}

bool is_load(const Call& call) {
  return call.call_type == CallType::Func || call.call_type == CallType::Image;
}

bool has_load(const Expr& index) {
  bool result = false;
  walk(index, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    result |= call && is_load(*call);
    return !result;
  });
  return result;
}

// Rule 1.
std::optional<size_t> dimension_of_points(const FuncContents& f, int lanes,
                                          const SizeEstimate& sizes) {
  int64_t numbers = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto extent = sizes.extent(f, d);
    if (!extent) return std::nullopt;
    if (d > 0 && *extent >= vectors_of_points * lanes) return d;
    numbers *= *extent;
    const bool is_short = d > 0 || (*extent > 1 && 2 * *extent <= lanes);
    if (!is_short || numbers < 1 || numbers > most_numbers) return std::nullopt;
  }
  return std::nullopt;
}

// Rule 2.
bool stays_at_points(const FuncContents& f, int index, size_t points) {
  const Definition& stage = f.stage(index);
  for (size_t d = 0; d < f.args.size(); ++d) {
    const bool is_fixed = d < points && as_const_int(stage.args[d]).has_value();
    if (!is_fixed && !is_pure_position(f, stage, d)) return false;
  }
  if (index == 0) return true;
  const bool chooses_by_data = stage.predicate.defined() && has_load(stage.predicate);
  return !point_number(stage) && !chooses_by_data && !scatters_in_order(f, stage) &&
         !read_elsewhere(f, stage).defined() &&
         !is_long_sum(f, stage, reduction_loops(f, stage), 1);
}

bool may_be_points(const FuncContents& f, size_t points) {
  const bool is_partial = f.made && (f.made->lanes > 0 || f.made->has_parts || f.made->blocks > 0);
  const bool has_wide_values =
      std::ranges::all_of(f.types, [](const Type& type) { return type.bits() >= 32; });
  if (is_partial || f.is_extern() || has_directives(f) || !has_wide_values) return false;
  for (int s = 0; s < f.stage_count(); ++s) {
    if (!stays_at_points(f, s, points)) return false;
  }
  return true;
}

// Rule 3, for one stage.
class PointCosts {
 public:
  PointCosts(const FuncContents& f, int index, size_t points, int lanes, const SizeEstimate& sizes)
      : f_(f), stage_(f.stage(index)), points_(points), lanes_(lanes), sizes_(sizes) {
    for (size_t d = 0; d < points; ++d) {
      if (is_pure_position(f, stage_, d)) numbers_ *= extent(d);
    }
  }

  // Of one vector of points, and of vectors along the first dimension of each of these.
  struct Cost {
    double along_points = 0, along_rows = 0;
  };
  // `is_turned`: whether a Func is stored along points.
  Cost find(const std::vector<FuncPtr>& stored,
            const std::function<bool(const FuncContents&)>& is_turned, double store) const {
    double operations = 0, loads = 0, reads = 0;
    std::unordered_set<const ExprNode*> seen;
    for (const Expr& root : roots_with_inlined(stage_, stored)) {
      walk(root, [&](const Expr& e) {
        if (!seen.insert(e.get()).second) return false;
        const auto* call = e.as<Call>();
        const bool is_read = call && is_load(*call);
        if (is_read && call->symbol.raw() == &f_) return false;
        if (is_read) {
          reads += 1;
          loads += copies_of(*call) * load_of(*call, is_turned);
        } else {
          operations += operations_of(e);
        }
        return true;
      });
    }
    const double terms = terms_of(stage_, unknown_terms);
    const double first = is_pure_position(f_, stage_, 0) ? extent(0) : 1;
    return {terms * (numbers_ * operations + loads) + numbers_ * store,
            lanes_ * numbers_ / first * (terms * (operations + reads) + 1)};
  }

 private:
  double extent(size_t d) const { return static_cast<double>(sizes_.extent(f_, d).value_or(1)); }

  double copies_of(const Call& call) const {
    double result = 1;
    for (size_t d = 0; d < points_; ++d) {
      const bool moves = std::ranges::any_of(
          call.args, [&](const Expr& index) { return uses_variable(index, f_.args[d]); });
      result *= moves ? extent(d) : 1;
    }
    return result;
  }

  double load_of(const Call& call,
                 const std::function<bool(const FuncContents&)>& is_turned) const {
    std::optional<size_t> moved;  // the first index that moves with the points
    for (size_t d = call.args.size(); d-- > 0;) {
      if (!uses_variable(call.args[d], f_.args[points_])) continue;
      if (has_load(call.args[d])) return planning::core.gather_lane_operations * lanes_;
      moved = d;
    }
    if (!moved) return 1;
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    if (*moved == innermost_dimension(call) || (callee && is_turned(*callee))) return 1;
    const auto stride = *moved == 1 ? row_of(call, callee) : std::nullopt;
    return stride && *stride <= small_stride ? static_cast<double>(*stride) : lanes_;
  }

  // The elements of a row of what is called, if they are known when it is compiled.
  std::optional<int64_t> row_of(const Call& call, const FuncPtr& callee) const {
    if (callee) return sizes_.extent(*callee, 0);
    const auto image = std::dynamic_pointer_cast<graph::ParameterContents>(call.symbol.lock());
    if (!image || image->constraints.empty()) return std::nullopt;
    const Expr& extent = image->constraints[0].extent;
    return extent.defined() ? as_const_int(extent) : std::nullopt;
  }

  const FuncContents& f_;
  const Definition& stage_;
  const size_t points_;
  const double lanes_;
  const SizeEstimate& sizes_;
  double numbers_ = 1;  // of a point that the stage computes
};

// What a store of one number of a vector of points takes.
double store_of(const FuncContents& f, size_t points, bool is_turned, bool is_result, int lanes) {
  if (is_turned) return 1;
  bool is_known = true;
  for (const auto& output : f.outputs) {
    for (size_t d = 0; is_result && d < points; ++d) {
      const auto& all = output->constraints;
      is_known &= d < all.size() && all[d].extent.defined() && as_const_int(all[d].extent);
    }
  }
  return is_known && !(is_result && f.outputs.empty()) ? 3 : lanes;
}

}  // namespace

PointFuncs::PointFuncs(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                       const std::unordered_set<const Symbol*>& excluded, int lanes,
                       const SizeEstimate& sizes) {
  for (const FuncPtr& f : stored) {
    const auto points =
        excluded.contains(f.get()) ? std::nullopt : dimension_of_points(*f, lanes, sizes);
    if (points && may_be_points(*f, *points)) points_.emplace(f.get(), *points);
  }
  if (points_.empty()) return;
  const StoredReads reads(outputs, stored);
  const auto reads_along_points = [&](const FuncContents& f, const StoredRead& read) {
    const FuncContents& by = *read.reader;
    return std::ranges::all_of(read.calls, [&](const Expr& e) {
      const std::vector<Expr>& args = e.as<Call>()->args;
      const size_t points = points_.at(&f);
      if (has_load(args[points])) return false;
      return points_.contains(&by) ||
             std::none_of(args.begin(), args.begin() + static_cast<long>(points),
                          [&](const Expr& index) { return uses_variable(index, by.args[0]); });
    });
  };
  const auto find_turned = [&] {
    turned_.clear();
    for (const FuncPtr& f : stored) {
      if (!points_.contains(f.get()) || is_result_of(outputs, *f) || reads.is_hidden(f)) continue;
      const bool is_turned = std::ranges::all_of(
          reads.of(f), [&](const StoredRead& read) { return reads_along_points(*f, read); });
      if (is_turned) turned_.insert(f.get());
    }
  };
  find_turned();
  const auto is_worth = [&](const FuncContents& f) {
    const size_t points = points_.at(&f);
    const bool turned = is_stored_along_points(f);
    const double store = store_of(f, points, turned, is_result_of(outputs, f), lanes);
    double along_points = 0, along_rows = 0;
    for (int s = 0; s < f.stage_count(); ++s) {
      const auto cost =
          PointCosts(f, s, points, lanes, sizes)
              .find(
                  stored, [&](const FuncContents& g) { return is_stored_along_points(g); }, store);
      along_points += cost.along_points;
      along_rows += cost.along_rows;
    }
    return along_points <= worth_turning * along_rows;
  };
  for (const FuncPtr& f : stored) {
    if (points_.contains(f.get()) && !is_worth(*f)) points_.erase(f.get());
  }
  find_turned();
}

std::optional<size_t> PointFuncs::points_of(const FuncContents& f) const {
  const auto found = points_.find(&f);
  return found == points_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace retrograde::autoschedule
