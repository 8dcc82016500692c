// resample_u16 -- see resample.h; planes of 16 bits.
#include "resample.h"

PROGRAM(resample_u16, programs::Resample, resampled<uint16_t>(65535, false).tolerance(1e-3))
