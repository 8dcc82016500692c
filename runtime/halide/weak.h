// The functions of HalideRuntime.h are weak, so that a program can replace them by its own.
#pragma once

#include <HalideRuntime.h>

#define RETROGRADE_WEAK extern "C" __attribute__((weak, visibility("default")))
