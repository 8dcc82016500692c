// models.h -- what cost models say about a plan.
#pragma once

#include <map>
#include <string>

#include "autoschedule/machine/machine.h"
#include "plan_sample.h"

namespace bench::plans {

struct Price {
  double seconds = 0;
  std::map<std::string, double> stages;  // seconds by Func
  double peak_bytes = 0;                 // of what the program allocates
  double price_seconds = 0;              // that the model took
};

// Prices a plan; throws what lowering throws.
using Model = std::function<Price(const planning::Plan& plan)>;

// By name: "predict" lowers a plan and walks the statement (tuning/predict.h), "cost" walks the plan
// (autoschedule/cost/cost.h).
std::map<std::string, Model> all_models(const planning::Machine& machine, const Target& target);

}  // namespace bench::plans
