// Options of the simulated device. They come from the environment until a program sets them.
#pragma once

#include "simt/simt_driver.h"

namespace retrograde::simt {
retrograde_simt_options& options();
}  // namespace retrograde::simt
