"""The devices on which operators run besides the CPU: where their tensors are, what is compiled for them, and the
stream that all of it is put into.
"""
import functools
import os

import torch

from .. import _retrograde as rg
from .._errors import Unsupported, error

_KNOWN = 90, 86, 80, 75  # capabilities that code is made for; one runs on later devices, too


class Device:
    """At `place`, one of PyTorch's; of a compute capability, as in 86 for 8.6."""

    def __init__(self, place, capability):
        known = next((c for c in _KNOWN if c <= capability), None)
        if known is None:
            raise error(Unsupported, f"run an operator on {place}",
                        f"its compute capability is {_KNOWN[-1] / 10} or more", f"it is {capability / 10}",
                        "Move the tensors with tensor.cpu()")
        self.place, self.target = place, f"{rg.get_host_target()}-cuda-cuda_capability_{known}"

    def current(self):
        """Within it the device's context is the thread's, which is where calls look for one."""
        return torch.cuda.device(self.place)

    def stream(self):
        """The address of the driver's."""
        return torch.cuda.current_stream(self.place).cuda_stream

    def empty(self, shape, dtype):
        return torch.empty(shape, dtype=dtype, device=self.place)


@functools.lru_cache(maxsize=None)
def device_of(place):
    """Of tensors at this place."""
    if place.type != "cuda":
        raise error(Unsupported, f"run an operator on {place}", "its tensors are the CPU's or CUDA's",
                    f"given are some on {place}", "Move the tensors with tensor.cpu()")
    if os.environ.get("RETROGRADE_GPU") == "simulated":
        raise error(Unsupported, f"run an operator on {place}", "the simulated device has memory of its own",
                    'RETROGRADE_GPU is "simulated"', "Unset RETROGRADE_GPU, or move the tensors with tensor.cpu()")
    major, minor = torch.cuda.get_device_capability(place)
    return Device(place, 10 * major + minor)
