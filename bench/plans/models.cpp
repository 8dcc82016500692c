#include "models.h"

#include <chrono>
#include <memory>

#include "autoschedule/cost/cost.h"
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
  return price;
}

// A program whose plans are priced.
struct PricedProgram {
  planning::ProgramPtr program;
  planning::AccessGraph accesses;
  planning::SizeModel sizes;
  planning::CostModel model;

  PricedProgram(planning::ProgramPtr priced, const planning::Machine& machine)
      : program(std::move(priced)),
        accesses(program->outputs),
        sizes(accesses, {planning::unknown_extent}),
        model(accesses, sizes, machine) {}
};

// Plans of a program share what its CostModel knows, as in a search.
class PlanPricer {
 public:
  explicit PlanPricer(const planning::Machine& machine) : machine_(machine) {}

  Price operator()(const planning::Plan& plan) {
    auto& priced = programs_[plan.program.get()];
    if (!priced) priced = std::make_unique<PricedProgram>(plan.program, machine_);
    const planning::Cost cost = priced->model.price(plan);
    Price price;
    price.seconds = cost.seconds;
    price.peak_bytes = cost.peak_bytes;
    for (const planning::StageCost& stage : cost.stages)
      price.stages[plan.program->funcs[static_cast<size_t>(stage.stage.func)]->name] +=
          stage.seconds;
    return price;
  }

 private:
  const planning::Machine machine_;
  std::map<const planning::Program*, std::unique_ptr<PricedProgram>> programs_;
};

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
  const auto pricer = std::make_shared<PlanPricer>(machine);
  return {{"cost", timed([=](const planning::Plan& plan) { return (*pricer)(plan); })},
          {"predict", timed([=](const planning::Plan& plan) {
             return predict_lowered(plan, machine, target);
           })}};
}

}  // namespace bench::plans
