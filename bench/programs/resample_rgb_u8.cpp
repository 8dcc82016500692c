// resample_rgb_u8 -- see resample.h; pixels of three bytes.
#include "resample.h"

PROGRAM(resample_rgb_u8, programs::Resample, resampled<uint8_t>(255, true).tolerance(0.02))
