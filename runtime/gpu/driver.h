// CUDA's driver, opened at run time: the real one, or with RETROGRADE_GPU=simulated in the environment
// the simulated one (simt_driver.h), which has the same functions. Which one is chosen, never guessed:
// where the real one is missing, calls fail and say so.
#pragma once

#include "gpu/driver_types.h"
#include "gpu/request.h"

namespace retrograde::runtime {

using namespace cuda;

struct Driver {
#define RETROGRADE_DRIVER(symbol, parameters) Result(*symbol) parameters = nullptr;
#include "gpu/driver_functions.def"
#undef RETROGRADE_DRIVER
  bool is_simulated = false;
};

// Opened and initialized with the first call that succeeds; null after an error, which was told.
const Driver* open_driver(const Request&);
// The same if it is open, else null.
const Driver* driver_if_open();

}  // namespace retrograde::runtime
