// Functions of HalideRuntime.h are weak: a program that defines one itself has its own called.
#pragma once

#include <HalideRuntime.h>

#define RETROGRADE_WEAK extern "C" __attribute__((weak, visibility("default")))
