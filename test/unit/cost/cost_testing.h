// Prices of plans that are given as text, on the reference machine.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/cost.h"
#include "support/variables.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {

inline constexpr double micro = 1e-6;

// Prices the plans of one program.
struct Pricing {
  explicit Pricing(const std::vector<graph::FuncPtr>& outputs, const Machine& machine = {})
      : machine(machine), program(make_program(outputs)), accesses(outputs) {}
  explicit Pricing(const std::vector<Func>& outputs, const Machine& machine = {})
      : Pricing(functions(outputs), machine) {}

  Cost price(const Plan& plan) { return model.price(plan); }
  Cost price(const std::string& text) { return price(parsed(text, program)); }

  const Machine machine;
  const ProgramPtr program;
  const AccessGraph accesses;
  const SizeModel sizes{accesses, assumed_sizes};
  CostModel model{accesses, sizes, machine};
};

inline Cost priced(const Func& out, const std::string& text, const Machine& machine = {}) {
  return Pricing({out}, machine).price(text);
}

inline Machine one_thread() {
  Machine machine;
  machine.threads = 1;
  return machine;
}

inline double memory_bytes(const Cost& cost) {
  double sum = 0;
  for (const StageCost& stage : cost.stages) sum += stage.bytes.back();
  return sum;
}

inline double compute_seconds(const Cost& cost) {
  double sum = 0;
  for (const StageCost& stage : cost.stages) sum += stage.compute_seconds;
  return sum;
}

}  // namespace retrograde::planning
