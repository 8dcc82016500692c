// li2018.cpp -- schedules gradients: Halide 14 uses Li2018, Retrograde its default schedule. For kernels without their
// own schedule it uses Retrograde's autoscheduler: "Retrograde", or its options ("search=true").
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
