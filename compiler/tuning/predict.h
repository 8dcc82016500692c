// predict.h -- how long a scheduled program takes, and each of its stages, on a machine.
//
// Prediction p = predict(function, program_sizes(function, output_shapes(outputs)), machine_for(target));
//
// What a stage computes and what it moves go on at the same time: it takes as long as the slower of both.
// Work of loops that run in parallel is shared by the threads, as far as there are iterations for all.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "autoschedule/machine/machine.h"
#include "ir/lowered_function.h"
#include "tuning/program_sizes.h"
#include "tuning/work_tree.h"

namespace retrograde::tuning {

struct StagePrediction {
  std::string name;  // of the Func; "" is what belongs to none
  double seconds = 0;
  double compute_seconds = 0, launch_seconds = 0;
  // Parts of compute_seconds, which overlap: bodies bound by a chain of dependent operations, accesses element by element
  // (gathers and scatters), scalar operations, and work outside of parallel loops.
  double chain_seconds = 0, element_seconds = 0, scalar_seconds = 0, one_thread_seconds = 0;
  // Bytes from behind each cache and the time that they take: "L2" are those that L1 has not.
  std::array<double, planning::Machine::level_count> bytes = {}, memory_seconds = {};
  Work work;                     // of one call, over all threads
  std::string bound_by() const;  // "compute", "L2", "L3", "memory", "launch"
  double all_memory_seconds() const;
};

struct Prediction {
  std::vector<StagePrediction> stages;  // in the order in which they are first computed
  double seconds = 0;
  double first_call_seconds = 0;  // more, for memory that is touched for the first time
};

// `threads`: that parallel loops may use; 0: those of the machine. Takes time in proportion to the text of
// the function, not to what it computes. The same function gives the same numbers.
Prediction predict(const LoweredFunction& function, const ProgramSizes& sizes,
                   const planning::Machine& machine, int threads = 0);
// The same for other figures of a machine whose vectors, registers and caches are as large: quick.
std::function<double(const planning::Machine&)> seconds_predictor(const LoweredFunction& function,
                                                                  const ProgramSizes& sizes,
                                                                  const planning::Machine& machine,
                                                                  int threads = 0);
double predicted_seconds(const LoweredFunction& function, const ProgramSizes& sizes,
                         const planning::Machine& machine, int threads = 0);

}  // namespace retrograde::tuning
