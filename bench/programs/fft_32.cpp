// fft_32 -- complex FFTs of 32 points, see fft.h.
#include "fft.h"

PROGRAM(fft_32, programs::SmallFft, ffts_of(32))
