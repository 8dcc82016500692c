"""Trace handlers for the tutorials. A handler is a C function made by ctypes."""
import ctypes

from retrograde.runtime import halide_trace_event_t

SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.POINTER(halide_trace_event_t))
STORE = 1


def stores_told_to(tell):
    """Returns a custom_trace handler that passes every store event to `tell`."""
    def handler(context, event):
        if event[0].event == STORE:
            tell(event[0])
        return 0
    return SIGNATURE(handler)
