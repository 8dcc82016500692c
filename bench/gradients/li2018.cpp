// li2018.cpp -- how gradients are scheduled: by Halide 14 with Li2018, by Retrograde as they come;
// and by its autoscheduler kernels without their schedules: "Retrograde", or its options
// ("search=true").
#include "gradient.h"

namespace kernels {

#ifdef BENCH_RETROGRADE
void schedule(Halide::Pipeline& pipeline, const Setup& setup) {
  if (setup.by_hand()) return;
  const std::string options = setup.schedule == "Retrograde" ? "" : setup.schedule;
  pipeline.auto_schedule(setup.target, retrograde::AutoscheduleOptions::from_string(options));
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
