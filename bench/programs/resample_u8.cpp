// resample_u8 -- see resample.h; planes of 8 bits.
#include "resample.h"

PROGRAM(resample_u8, programs::Resample, resampled<uint8_t>(255, false).tolerance(0.02))
