// The destination of trace packets.
#pragma once

#include <cstdint>

#include "retrograde_runtime.h"

namespace retrograde::runtime {

// The descriptor that was set, or of the file that HL_TRACE_FILE names; 0: none, so text is printed.
int trace_file();
// 0: none. Closes the file that HL_TRACE_FILE named; returns false if data written to it were lost.
bool set_trace_file(int file);

// Returns the event's number.
int32_t trace_to(int file, retrograde_context* context, const halide_trace_event_t* event);

}  // namespace retrograde::runtime
