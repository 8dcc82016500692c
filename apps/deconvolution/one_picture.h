// one_picture.h -- deconvolves the input: a photograph that is blurred first and compared, or a blurred one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/report.h"
#include "deconvolver.h"
#include "options.h"

namespace deconvolution {

// Hears of every look at the flag between two iterations: of a method, a channel, and how many there were.
using Heard = std::function<void(const std::string& method, size_t channel, int iterations)>;

// By each method in turn, a colour channel after the other; the last method's is result.png, and result.exr when
// the input holds floats. Throws retrograde::Error. Gives the iterations.
//
// Stopped, it ends before the next iteration, and result.png is the best so far: each channel by the last method
// that finished it, or, where none did, as far as the first one came, or blurred. (The first stages of a method are
// worse than the whole of the one before it.)
long deconvolve_input(const Options& options, const std::vector<Method>& methods,
                      apps::Report& report, const Heard& heard = {});

}  // namespace deconvolution
