// Selection of CUDA contexts and streams by the functions of HalideRuntimeCuda.h.
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {
const retrograde_gpu_handlers* halide_gpu_handlers();
}  // namespace retrograde::runtime
