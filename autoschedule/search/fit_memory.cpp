#include "autoschedule/search/fit_memory.h"

#include <algorithm>
#include <initializer_list>
#include <optional>

namespace retrograde::planning {

namespace {

constexpr double worth_a_step = 0.99;  // of the bytes before, at most

// Moves of a Func that lies in memory. One that does not may let others go if it is stored: a sum of a few adjoints lets
// these go.
constexpr std::initializer_list<const char*> out_of_memory = {"inline_func", "compute_at",
                                                              "compute_in_tile", "slide"},
                                             into_memory = {"root"};

constexpr int most_rounds = 8;

// A plan after a move of a Func.
struct Step {
  FuncId func;
  const char* move;
  size_t number;  // of the plans of the move
  double price;   // seconds for a byte
};

class MemoryFitter {
 public:
  MemoryFitter(const Context& context, CostModel& cost, const SearchOptions& options,
               double most_seconds)
      : context_(context), cost_(cost), options_(options), most_seconds_(most_seconds) {}

  FoundPlan fit(FoundPlan found) const {
    for (int round = 0; round < most_rounds && exceeds(found.cost.peak_bytes); ++round) {
      const double before = found.cost.peak_bytes;
      for (const Step& step : steps_from(found)) {
        if (!exceeds(found.cost.peak_bytes)) break;
        take(found, step);
      }
      if (found.cost.peak_bytes > worth_a_step * before) break;
    }
    return found;
  }

 private:
  const Context& context_;
  CostModel& cost_;
  const SearchOptions& options_;
  const double most_seconds_;

  bool exceeds(double bytes) const { return bytes > options_.most_bytes; }
  bool is_worth(const Totals& after, const FoundPlan& before) const {
    return after.peak_bytes <= worth_a_step * before.cost.peak_bytes &&
           after.seconds <= most_seconds_;
  }

  // The best of each Func, those of the fewest seconds for a byte first.
  std::vector<Step> steps_from(const FoundPlan& found) const {
    const double excess = found.cost.peak_bytes - options_.most_bytes;
    std::vector<Step> result;
    for (size_t f = 0; f < found.plan.funcs.size(); ++f) {
      const auto func = static_cast<FuncId>(f);
      const bool in_memory = found.plan.of(func).placement.compute.kind == Level::Kind::Root;
      const bool is_kept = f < options_.kept.size() && options_.kept[f];
      if (is_kept || is_output(*found.plan.program, func)) continue;
      std::optional<Step> best;
      for (const char* move : in_memory ? out_of_memory : into_memory) {
        if (options_.without.contains(move) || !find_move(move)->is_for(context_)) continue;
        const std::vector<Plan> plans = find_move(move)->apply(found.plan, func, context_);
        for (size_t i = 0; i < plans.size(); ++i) {
          if (!keeps_funcs(found.plan, plans[i], options_)) continue;
          const Totals after = cost_.totals(plans[i]);
          if (!is_worth(after, found)) continue;
          const double saved = found.cost.peak_bytes - after.peak_bytes;
          const double price = (after.seconds - found.cost.seconds) / std::min(saved, excess);
          if (!best || price < best->price) best = Step{func, move, i, price};
        }
      }
      if (best) result.push_back(*best);
    }
    std::ranges::stable_sort(result, {}, &Step::price);
    return result;
  }

  // Takes the step from a later plan, where it still saves bytes.
  void take(FoundPlan& found, const Step& step) const {
    std::vector<Plan> plans = find_move(step.move)->apply(found.plan, step.func, context_);
    if (step.number >= plans.size()) return;
    Plan& plan = plans[step.number];
    if (!keeps_funcs(found.plan, plan, options_) || !is_worth(cost_.totals(plan), found)) return;
    found.cost = cost_.price(plan);
    found.plan = std::move(plan);
    found.steps.push_back({step.func, step.move, found.cost.seconds});
  }
};

}  // namespace

FoundPlan fit_memory(FoundPlan found, const Context& context, CostModel& cost,
                     const SearchOptions& options, double most_seconds) {
  return MemoryFitter(context, cost, options, most_seconds).fit(std::move(found));
}

}  // namespace retrograde::planning
