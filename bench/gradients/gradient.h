// gradient.h -- what a gradient of the benchmark is: a pipeline that is written once, in the
// dialect that Halide 14 and Retrograde share, and whose gradients each compiler makes and
// schedules itself: Halide with its autoscheduler for gradients, Li2018, Retrograde with what it
// does when no directive says otherwise.
#pragma once

#include "../kernels/kernel.h"

namespace kernels {

// Called once for a pipeline whose outputs have estimates; linked in: li2018.cpp, or
// ../operators/schedules.cpp.
void schedule(Halide::Pipeline& pipeline, const Setup& setup);

// A forward pipeline that has no schedule.
void schedule_kernel(Kernel& kernel, const Setup& setup);

// The gradients of the sum of seed * output by each of `by`, in that order; inputs are `by`, what is
// `fixed` (no gradient is asked by it) and the seed. `operations` are those of all that is computed. Source of Li2018: Li et al., Differentiable
// Programming for Image Processing and Deep Learning in Halide, SIGGRAPH 2018, section 5.
Kernel gradients_of(const Setup& setup, const Halide::Func& output,
                    const std::vector<int>& output_sizes,
                    const std::vector<Halide::Buffer<real>>& by, double operations,
                    const std::vector<Halide::Buffer<real>>& fixed = {});

// From -1 to 1, with no relation to any other input: a seed like the input of a normalisation has a
// gradient of rounding errors.
Halide::Buffer<real> make_noise(const std::vector<int>& sizes, uint32_t which = 12345);

// Values from `low` to just below `high`.
Halide::Buffer<real> make_values(const std::vector<int>& sizes, float low, float high);

}  // namespace kernels
