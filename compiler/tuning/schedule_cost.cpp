// schedule_cost.cpp -- the predicted time of a graph with its schedule, for those who search one.
#include "autoschedule/machine/kept_machine.h"
#include "frontend/run/compiler_interface.h"
#include "lower/lower.h"
#include "tuning/predict.h"

namespace retrograde {

double predicted_seconds(const std::vector<graph::FuncPtr>& scheduled, const Target& target,
                         int threads) {
  lower::LowerOptions lowering;
  lowering.target = target;
  const ir::LoweredFunction function =
      lower::lower("searched", scheduled, lower::infer_arguments(scheduled), lowering);
  return tuning::predicted_seconds(
      function, tuning::program_sizes(function, tuning::output_shapes(scheduled)),
      planning::machine_for(target), threads);
}

}  // namespace retrograde
