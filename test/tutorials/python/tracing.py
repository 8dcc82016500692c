"""For the tutorials: what traces tell. A handler is a C function of ctypes."""
import ctypes

from retrograde.runtime import halide_trace_event_t

SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.POINTER(halide_trace_event_t))
STORE = 1


def stores_told_to(tell):
    """A custom_trace that tells of every store."""
    def handler(context, event):
        if event[0].event == STORE:
            tell(event[0])
        return 0
    return SIGNATURE(handler)
