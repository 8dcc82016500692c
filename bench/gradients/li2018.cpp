// li2018.cpp -- how gradients are scheduled: by Halide 14 with Li2018, by Retrograde as they come;
// and by its autoscheduler kernels without their schedules.
#include "gradient.h"

namespace kernels {

#ifdef BENCH_RETROGRADE
void schedule(Halide::Pipeline& pipeline, const Setup& setup) {
  if (!setup.by_hand()) pipeline.auto_schedule(setup.target);
}
#else
void schedule(Halide::Pipeline& pipeline, const Setup& setup) {
  Halide::load_plugin(BENCH_LI2018);
  Halide::MachineParams machine = Halide::MachineParams::generic();
  machine.parallelism = setup.threads;
  pipeline.auto_schedule("Li2018", setup.target, machine);
}
#endif

}  // namespace kernels
