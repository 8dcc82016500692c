// Contexts of calls that only report errors and print.
#pragma once

#include "retrograde_runtime.h"

namespace retrograde::runtime {

// Errors and text go to halide_error and halide_print, with the caller's user context.
retrograde_context reporting_context(void* user_context);

}  // namespace retrograde::runtime
