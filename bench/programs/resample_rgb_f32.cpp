// resample_rgb_f32 -- see resample.h; pixels of three floats.
#include "resample.h"

PROGRAM(resample_rgb_f32, programs::Resample, resampled<float>(1, true))
