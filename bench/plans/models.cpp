#include "models.h"

#include <chrono>

#include "autoschedule/memory_estimate.h"
#include "lower/lower.h"
#include "tuning/predict.h"

namespace bench::plans {

using namespace retrograde;

namespace {

Price predict_lowered(const planning::Plan& plan, const planning::Machine& machine,
                      const Target& target) {
  const std::vector<FuncPtr> outputs = planning::emit_plan(plan);
  lower::LowerOptions options;
  options.target = target;
  const auto function = lower::lower("priced", outputs, lower::infer_arguments(outputs), options);
  const auto sizes = tuning::program_sizes(function, tuning::output_shapes(outputs));
  const tuning::Prediction predicted = tuning::predict(function, sizes, machine);
  Price price;
  price.seconds = predicted.seconds;
  for (const tuning::StagePrediction& stage : predicted.stages)
    price.stages[stage.name] += stage.seconds;
  const autoschedule::SizeEstimate estimate(outputs, machine);
  price.peak_bytes = static_cast<double>(
      autoschedule::estimate_memory(outputs, estimate, machine.threads).peak_bytes);
  return price;
}

Model timed(const Model& model) {
  return [model](const planning::Plan& plan) {
    const auto begin = std::chrono::steady_clock::now();
    Price price = model(plan);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    price.price_seconds = spent.count();
    return price;
  };
}

}  // namespace

std::map<std::string, Model> all_models(const planning::Machine& machine, const Target& target) {
  return {{"predict", timed([=](const planning::Plan& plan) {
             return predict_lowered(plan, machine, target);
           })}};
}

}  // namespace bench::plans
