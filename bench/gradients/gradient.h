// gradient.h -- the interface of gradient benchmarks. A pipeline is written once, in the common subset of Halide 14 and
// Retrograde; each compiler derives and schedules its gradients: Halide with Li2018, its autoscheduler for gradients,
// and Retrograde with its default schedule.
#pragma once

#include "../kernels/kernel.h"

namespace kernels {

// Schedules a pipeline whose outputs have estimates; called once per pipeline. The linked file decides how: li2018.cpp,
// or ../operators/schedules.cpp.
void schedule(Halide::Pipeline& pipeline, const Setup& setup);

// Schedules a forward pipeline that has no schedule.
void schedule_kernel(Kernel& kernel, const Setup& setup);

// The gradients of the sum of seed * output with respect to each of `by`, in that order. The inputs are `by`, `fixed`
// (without a gradient), and the seed. `operations` counts everything that is computed. Source of Li2018: Li et al.,
// Differentiable Programming for Image Processing and Deep Learning in Halide, SIGGRAPH 2018, section 5.
Kernel gradients_of(const Setup& setup, const Halide::Func& output,
                    const std::vector<int>& output_sizes,
                    const std::vector<Halide::Buffer<real>>& by, double operations,
                    const std::vector<Halide::Buffer<real>>& fixed = {});

// Values from -1 to 1, unrelated to any other input: with a seed that resembles the input of a normalisation, the
// gradient would consist of rounding errors.
Halide::Buffer<real> make_noise(const std::vector<int>& sizes, uint32_t which = 12345);

// Values from `low` to just below `high`.
Halide::Buffer<real> make_values(const std::vector<int>& sizes, float low, float high);

}  // namespace kernels
