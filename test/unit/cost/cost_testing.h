// Prices of plans that are given as text, on a machine with round figures.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "autoschedule/cost/cost.h"
#include "support/variables.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {

inline constexpr double micro = 1e-6;

// Two threads, each with 32 registers of 64 bytes. Tests compute by hand with these figures.
inline Machine probed_machine() {
  Machine m;
  m.levels = {Machine::Level{"L1", 32 << 10, 256, 512}, Machine::Level{"L2", 1 << 20, 80, 160},
              Machine::Level{"L3", 16 << 20, 18, 24}, Machine::Level{"memory", 1e15, 9, 18}};
  m.operation_ns = m.load_ns = 0.2;
  m.store_ns = m.gather_lane_ns = 0.35;
  m.exp_ns = 4;
  m.latency_ns = 1.3;
  m.memory_latency_ns = 2.5;
  m.iteration_ns = 0.3;
  m.launch_ns = 5000;
  return m;
}

// Prices the plans of one program.
struct Pricing {
  explicit Pricing(const std::vector<graph::FuncPtr>& outputs,
                   const Machine& machine = probed_machine())
      : machine(machine), program(make_program(outputs)), accesses(outputs) {}
  explicit Pricing(const std::vector<Func>& outputs, const Machine& machine = probed_machine())
      : Pricing(functions(outputs), machine) {}

  Cost price(const Plan& plan) { return model.price(plan); }
  Cost price(const std::string& text) { return price(parsed(text, program)); }

  const Machine machine;
  const ProgramPtr program;
  const AccessGraph accesses;
  const SizeModel sizes{accesses, {unknown_extent}};
  CostModel model{accesses, sizes, machine};
};

inline Cost priced(const Func& out, const std::string& text,
                   const Machine& machine = probed_machine()) {
  return Pricing({out}, machine).price(text);
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
