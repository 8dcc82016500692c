// retrograde.h -- everything that a pipeline's author needs, in one include.
#pragma once

#include "diagnostics/error.h"
