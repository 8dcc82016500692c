// measure_schedule.h -- how long a scheduled graph takes on this machine, on inputs that are made up.
#pragma once

#include <memory>
#include <vector>

#include "frontend/data/buffer.h"
#include "graph/function.h"
#include "ir/target.h"

namespace retrograde::tuning {

// Binds what the graph reads and nobody bound: images of the sizes that are known or estimated, with
// random values, the same every time (numbers in [0, 1), small whole ones); scalars to their
// estimates. They stay bound as long as the parameters are.
void bind_sample_inputs(const std::vector<FuncPtr>& outputs);

// Buffers for the values of all outputs, of the sizes that are known or estimated.
std::vector<Buffer<>> sample_outputs(const std::vector<FuncPtr>& outputs);

struct MeasuredSchedule {
  double seconds = 0;  // of the fastest run
  int runs = 0;
};
struct MeasureOptions {
  double seconds = 0.5;         // that it runs, at least 3 times
  double hopeless_seconds = 0;  // not 0: one run that takes longer is the only one
  int threads = 0;              // 0: all
};

// A scheduled graph whose inputs are bound, compiled.
class CompiledSchedule {
 public:
  // `threads`: 0: all.
  CompiledSchedule(const std::vector<FuncPtr>& scheduled, const Target& target, int threads);
  CompiledSchedule(const CompiledSchedule&) = delete;
  CompiledSchedule& operator=(const CompiledSchedule&) = delete;
  ~CompiledSchedule();
  double run() const;  // the seconds of one call

 private:
  struct Call;
  std::unique_ptr<Call> call_;
};

// Compiles it and runs it. Its inputs are bound.
MeasuredSchedule measure_schedule(const std::vector<FuncPtr>& scheduled, const Target& target,
                                  const MeasureOptions& options);

}  // namespace retrograde::tuning
