// For tests that run kernels on the simulated device. Including this header selects it before any code asks for a
// device.
#pragma once

#include <cstdlib>

#include "ir/target.h"

namespace retrograde {

[[maybe_unused]] inline const int simulated = setenv("RETROGRADE_GPU", "simulated", 1);

// A fixed capability, not this machine's: generated code must be the same everywhere.
inline Target with_gpu() {
  return get_host_target().with_feature(Target::CUDA).with_feature(Target::CUDACapability80);
}

}  // namespace retrograde
