// fuzz_gpu -- searches for random programs under random GPU schedules whose kernels, on the simulated device, disagree
// with the interpreter, race, or access memory that they do not own. Each program runs under every order of threads.
// support/fuzz.h describes the arguments.
#include <cstdlib>

#include "simt/simt_driver.h"
#include "support/fuzz.h"
#include "testing/check_program.h"
#include "testing/random_gpu_schedule.h"

namespace {

void run_in(int order) {
  retrograde_simt_options options;
  retrograde_simt_get_options(&options);
  options.order = order;
  retrograde_simt_set_options(&options);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace retrograde;
  using namespace retrograde::fuzz;
  setenv("RETROGRADE_GPU", "simulated", 1);
  const Target target =
      get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80);
  const auto make = [](Choices& choices) { return make_program(choices, Style::pipelines()); };
  std::vector<std::function<void()>> orders;
  for (int order = retrograde_simt_forward; order <= retrograde_simt_warp_ahead; ++order)
    orders.push_back([order] { run_in(order); });
  const auto judge = [&](Choices& choices, bool) {
    const RandomProgram program = make(choices);
    GpuScheduleCounts used;
    Judged judged = check_with_schedule(
        program, [&] { used = schedule_on_gpu(program, choices); }, target, orders);
    if (judged.judgement == Judgement::Right) judged.counts.merge(used);
    return judged;
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
