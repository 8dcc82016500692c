#include "transform/wavefronts.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "analysis/linear.h"
#include "graph/definitions/race_checks.h"
#include "graph/definitions/reduction_domain.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"
#include "transform/cost_estimate.h"
#include "transform/rewritable_updates.h"
#include "transform/step_variables.h"

namespace retrograde::transform {

namespace {

constexpr int most_slope = 4;
constexpr int unrolled_rows = 8;  // hide the latency of two operations
constexpr int64_t most_pure_elements = 4;
// Operations of a value from which a vector saves more than loads and stores with a stride cost.
constexpr double vectors_pay = 8;

// How many points of a front run at once, and whether in a vector or unrolled.
struct FrontLanes {
  int rows = 1;
  bool in_vectors = false;
};
FrontLanes front_lanes(const Definition& update) {
  const double operations = operations_of_values(update.values, [](const Call&) { return 0.0; });
  const bool in_vectors = operations >= vectors_pay;
  return {in_vectors ? planning::schedule_lanes : unrolled_rows, in_vectors};
}

// How many dimensions of the written element the variable moves; -1: one of them by more than one element.
int moved_dimensions(const Definition& update, const std::string& variable) {
  int moved = 0;
  for (const Expr& arg : update.args) {
    if (!uses_variable(arg, variable)) continue;
    const auto form = analysis::decompose(arg, {variable});
    if (!form || form->coefficients.size() != 1 || std::abs(form->coefficients[0].second) != 1)
      return -1;
    ++moved;
  }
  return moved;
}

// Whether `inner` runs along one dimension, and `outer` along another one or again and again along the same.
bool are_along_rows(const Definition& update, const std::string& inner, const std::string& outer) {
  const int rows = moved_dimensions(update, outer);
  return moved_dimensions(update, inner) == 1 && (rows == 0 || rows == 1) &&
         std::ranges::none_of(update.args, [&](const Expr& arg) {
           return uses_variable(arg, inner) && uses_variable(arg, outer);
         });
}

class WavefrontFinder {
 public:
  explicit WavefrontFinder(const std::vector<FuncPtr>& outputs) : rewritable_(outputs) {}

  // The slope of the fronts; nullopt: there are none.
  std::optional<int> slope(const FuncContents& f, const Definition& update) {
    if (update.rvars.size() < 2) return std::nullopt;
    const ReductionVariable &inner = update.rvars[0], &outer = update.rvars[1];
    const FrontLanes lanes = front_lanes(update);
    // A block has slope * (rows - 1) fronts more than columns, on which rows wait for others.
    const int waits = (lanes.in_vectors ? 1 : 2) * (lanes.rows - 1);
    if (!is_long(inner.extent, waits) || !is_long(outer.extent, lanes.rows) ||
        !are_along_rows(update, inner.var, outer.var) ||
        !rewritable_.contain(f, update, most_pure_elements) ||
        step_variables(f, update).any_independent())
      return std::nullopt;
    const auto is_legal = [&](int slope) {
      return graph::can_prove_skewed_order(f, update, inner.var, outer.var, slope);
    };
    if (!is_legal(most_slope)) return std::nullopt;  // nor any smaller one
    int slope = 1;
    while (slope < most_slope && !is_legal(slope)) ++slope;
    return is_long(inner.extent, slope * waits) ? std::optional(slope) : std::nullopt;
  }

 private:
  RewritableUpdates rewritable_;
};

// Replaces the two innermost loops of an update by three.
class Skewer {
 public:
  Skewer(FuncContents& f, Definition& update, int slope)
      : f_(f), update_(update), slope_(slope), rows_(front_lanes(update).rows) {}

  void run() {
    add_loops();
    const Expr predicate = update_.predicate;
    Definition skewed =
        graph::map_exprs(update_, [&](const Expr& e) { return substitute(e, places_); });
    if (predicate.defined()) conditions_.push_back(substitute(predicate, places_));
    skewed.predicate = conjunction(conditions_);
    skewed.rvars = domain_->vars;
    skewed.schedule = {};
    skewed.schedule.dims = graph::first_loops(f_, skewed);
    update_ = std::move(skewed);
    ++f_.version;
  }

 private:
  void add_loops() {
    const ReductionVariable &inner = update_.rvars[0], &outer = update_.rvars[1];
    const Expr columns = inner.extent, lines = outer.extent;
    const Expr row = add_loop(domain_, "row", 0, rows_);
    const Expr front = add_loop(domain_, "front", 0, simplify(columns + slope_ * (rows_ - 1)));
    const Expr block = add_loop(domain_, "rows", 0, simplify((lines + (rows_ - 1)) / rows_));
    place(inner, front - slope_ * row);
    place(outer, block * rows_ + row);
    for (size_t i = 2; i < update_.rvars.size(); ++i) {
      const ReductionVariable& r = update_.rvars[i];
      places_[r.var] = add_loop(domain_, without_numbers(r.var), r.min, r.extent);
    }
  }

  // `number`: of the iteration, which may lie outside of the domain.
  void place(const ReductionVariable& r, const Expr& number) {
    conditions_.push_back(likely(number >= 0));
    conditions_.push_back(likely(number < r.extent));
    const Expr at = simplify(number + r.min);
    places_[r.var] = call_op(Op::promise_clamped, Int(32),
                             {at, simplify(r.min), simplify(r.min + r.extent - 1)});
  }

  FuncContents& f_;
  Definition& update_;
  const int slope_, rows_;
  const DomainPtr domain_ = make_domain();
  Substitution places_;  // of the old variables
  std::vector<Expr> conditions_;
};

}  // namespace

bool has_wavefronts(const std::vector<FuncPtr>& outputs) {
  WavefrontFinder finder(outputs);
  return std::ranges::any_of(topological_order(outputs), [&](const FuncPtr& f) {
    return std::ranges::any_of(
        f->updates, [&](const Definition& update) { return finder.slope(*f, update).has_value(); });
  });
}

void run_in_wavefronts(const std::vector<FuncPtr>& outputs) {
  WavefrontFinder finder(outputs);
  for (const FuncPtr& f : topological_order(outputs)) {
    for (Definition& update : f->updates) {
      if (const auto slope = finder.slope(*f, update)) Skewer(*f, update, *slope).run();
    }
  }
}

}  // namespace retrograde::transform
