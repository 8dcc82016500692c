// one_picture.h -- deconvolves the input: a photograph, which is blurred first and compared with, or a blurred one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/report.h"
#include "deconvolver.h"
#include "options.h"

namespace deconvolution {

// Called whenever the stop flag is checked between iterations: with the method, channel and number of iterations.
using Heard = std::function<void(const std::string& method, size_t channel, int iterations)>;

// Applies each method in turn, to one colour channel after another. The last method's result is result.png, and
// result.exr if the input holds floats. Throws retrograde::Error. Returns the number of iterations.
//
// If it is stopped, it ends before the next iteration, and result.png is the best result so far. For each channel that
// is the result of the last method that finished it; otherwise the first method's partial result, or the blurred
// channel. (The first stages of a method are worse than the previous method's final result.)
long deconvolve_input(const Options& options, const std::vector<Method>& methods,
                      apps::Report& report, const Heard& heard = {});

}  // namespace deconvolution
