// schedule_halide.cpp -- the schedule of the Halide peer: Halide 14's Li2018 autoscheduler. All groups move.
#include <string>

#include "training_pipeline.h"

namespace bilateral_slice {

namespace {

using Bounds = Halide::Region;

void estimate(Learned& learned, const Bounds& bounds) {
  for (Halide::ImageParam* input : {&learned.value, &learned.moment, &learned.square}) {
    input->set_estimates(bounds);
  }
  learned.next.set_estimates(bounds);
}

void estimate_sizes(TrainingPipeline& training) {
  const Shape& shape = training.model.shape;
  const int coefficients = shape.coefficients(), channels = shape.channels;
  training.model.photo.set_estimates({{0, shape.width}, {0, shape.height}, {0, coefficients}});
  training.model.target.set_estimates({{0, shape.width}, {0, shape.height}, {0, channels}});
  estimate(
      *training.grid,
      {{0, coefficients}, {0, channels}, {0, shape.grid_z}, {0, shape.grid_x}, {0, shape.grid_y}});
  estimate(*training.mix, {{0, coefficients}});
  estimate(*training.curve, {{0, shape.knots}});
  training.rate.set_estimate(0.01f);
  training.m_scale.set_estimate(1.0f);
  training.v_scale.set_estimate(1.0f);
}

// The autoscheduler's machine parameters. Cache size and the cost of a load relative to an operation are Halide's
// generic ones.
Halide::MachineParams machine(int threads) {
  Halide::MachineParams params = Halide::MachineParams::generic();
  params.parallelism = threads;
  return params;
}

}  // namespace

void schedule(TrainingPipeline& training, int threads) {
  estimate_sizes(training);
  Halide::load_plugin(BILATERAL_SLICE_LI2018);
  // Halide 14 mistakes AMD's Zen 4 for a Sapphire Rapids, some of whose instructions it lacks.
  const Halide::Target target =
      Halide::get_host_target().without_feature(Halide::Target::AVX512_SapphireRapids);
  training.pipeline.auto_schedule("Li2018", target, machine(threads));
  training.pipeline.compile_jit(target);
}

}  // namespace bilateral_slice
