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

}  // namespace

FoundPlan fit_memory(FoundPlan found, const Context& context, CostModel& cost,
                     const SearchOptions& options, double most_seconds) {
  while (found.cost.peak_bytes > options.most_bytes) {
    const double excess = found.cost.peak_bytes - options.most_bytes;
    std::optional<FoundPlan> best;
    double least = 0;  // seconds for a byte
    for (size_t f = 0; f < found.plan.funcs.size(); ++f) {
      const auto func = static_cast<FuncId>(f);
      const bool in_memory = found.plan.of(func).placement.compute.kind == Level::Kind::Root;
      const bool is_kept = f < options.kept.size() && options.kept[f];
      if (is_kept || is_output(*found.plan.program, func)) continue;
      for (const char* move : in_memory ? out_of_memory : into_memory) {
        if (options.without.contains(move) || !find_move(move)->is_for(context)) continue;
        for (Plan& plan : find_move(move)->apply(found.plan, func, context)) {
          if (!keeps_funcs(found.plan, plan, options)) continue;
          Cost after = cost.price(plan);
          const double saved = found.cost.peak_bytes - after.peak_bytes;
          if (after.peak_bytes > worth_a_step * found.cost.peak_bytes ||
              after.seconds > most_seconds)
            continue;
          const double each = (after.seconds - found.cost.seconds) / std::min(saved, excess);
          if (best && each >= least) continue;
          least = each;
          best = FoundPlan{std::move(plan), std::move(after), found.steps};
          best->steps.push_back({func, move, best->cost.seconds});
        }
      }
    }
    if (!best) break;
    found = *std::move(best);
  }
  return found;
}

}  // namespace retrograde::planning
