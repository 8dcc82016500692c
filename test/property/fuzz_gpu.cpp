// fuzz_gpu -- looks for random programs under random GPU schedules whose kernels, on the simulated
// device, disagree with the interpreter, race, or touch what is not theirs. Arguments: support/fuzz.h.
#include <cstdlib>

#include "support/fuzz.h"
#include "testing/check_program.h"
#include "testing/random_gpu_schedule.h"

int main(int argc, char** argv) {
  using namespace retrograde;
  using namespace retrograde::fuzz;
  setenv("RETROGRADE_GPU", "simulated", 1);
  const Target target =
      get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80);
  const auto make = [](Choices& choices) { return make_program(choices, Style::pipelines()); };
  const auto judge = [&](Choices& choices, bool) {
    const RandomProgram program = make(choices);
    return check_with_schedule(
        program, [&] { schedule_on_gpu(program, choices); }, target);
  };
  const auto text = [&](Choices& choices) {
    const RandomProgram program = make(choices);
    try {
      schedule_on_gpu(program, choices);
    } catch (const Error&) {
    }
    return to_text(program);
  };
  return fuzz_main({.judge = judge, .text = text, .most_slow = 0.01}, argc, argv);
}
