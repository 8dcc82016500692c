// gradient.h -- what a gradient of the benchmark is: a pipeline that is written once, in the
// dialect that Halide 14 and Retrograde share, and whose gradients each compiler makes and
// schedules itself: Halide with its autoscheduler for gradients, Li2018, Retrograde with what it
// does when no directive says otherwise.
#pragma once

#include "../kernels/kernel.h"

namespace kernels {

// The gradients of the sum of seed * output by each of `by`, in that order; inputs are `by` and the
// seed. `operations` are those of the gradients alone. Source of Li2018: Li et al., Differentiable
// Programming for Image Processing and Deep Learning in Halide, SIGGRAPH 2018, section 5.
Kernel gradients_of(const Setup& setup, const Halide::Func& output,
                    const std::vector<int>& output_sizes,
                    const std::vector<Halide::Buffer<float>>& by, double operations);

// Values from `low` to just below `high`.
Halide::Buffer<float> make_values(const std::vector<int>& sizes, float low, float high);

}  // namespace kernels
