// fft_16 -- complex FFTs of 16 points, see fft.h.
#include "fft.h"

PROGRAM(fft_16, programs::SmallFft, ffts_of(16))
