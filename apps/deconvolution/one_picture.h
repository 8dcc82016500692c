// one_picture.h -- deconvolves the input: a photograph that is blurred first and compared, or a blurred one.
#pragma once

#include <vector>

#include "common/report.h"
#include "deconvolver.h"
#include "options.h"

namespace deconvolution {

// By each method in turn, a colour channel after the other; the last method's is result.png, and result.exr when
// the input holds floats. Stopped, it keeps what there is. Throws retrograde::Error. Gives the iterations.
long deconvolve_input(const Options& options, const std::vector<Method>& methods,
                      apps::Report& report);

}  // namespace deconvolution
