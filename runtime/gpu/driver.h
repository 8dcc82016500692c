// The CUDA driver, opened at run time. RETROGRADE_GPU=simulated in the environment selects the simulated device
// (simt_driver.h), which has the same functions. The choice is never guessed: if the real driver is missing, calls fail
// and say so.
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

// Opens and initialises the driver on the first call that succeeds; null after an error, which is reported.
const Driver* open_driver(const Request&);
// The driver if it is open, else null.
const Driver* driver_if_open();

}  // namespace retrograde::runtime
