// Where the packets of traces go.
#pragma once

#include <cstdint>

#include "retrograde_runtime.h"

namespace retrograde::runtime {

// The descriptor that was set, or that of the file that HL_TRACE_FILE names; 0: none, text is
// printed.
int trace_file();
// 0: none. The file that HL_TRACE_FILE named is closed; false when what was written to it is lost.
bool set_trace_file(int file);

// Gives the event's number.
int32_t trace_to(int file, retrograde_context* context, const halide_trace_event_t* event);

}  // namespace retrograde::runtime
