// internal.h -- everything that Halide.h brings into Halide::Internal.
#pragma once

#include "porting/expressions.h"
#include "porting/host.h"
#include "porting/interval.h"
#include "porting/reports.h"
#include "porting/shared_runtime.h"
