"""The CUDA devices that operators run on: the place of the tensors, the target to compile for, and the stream."""
import functools
import os

import torch

from .. import _retrograde as rg
from .._errors import Unsupported, error

_KNOWN = 90, 86, 80, 75  # compute capabilities to compile for; code for one also runs on later devices


class Device:
    """A device at `place`, a torch.device, with a compute capability such as 86 for 8.6."""

    def __init__(self, place, capability):
        known = next((c for c in _KNOWN if c <= capability), None)
        if known is None:
            raise error(Unsupported, f"run an operator on {place}",
                        f"its compute capability is {_KNOWN[-1] / 10} or more", f"it is {capability / 10}",
                        "Move the tensors with tensor.cpu()")
        self.place, self.target = place, f"{rg.get_host_target()}-cuda-cuda_capability_{known}"

    def current(self):
        """A context manager that makes the device's CUDA context current for this thread, as calls require."""
        return torch.cuda.device(self.place)

    def stream(self):
        """The driver's handle of the current stream."""
        return torch.cuda.current_stream(self.place).cuda_stream

    def empty(self, shape, dtype):
        return torch.empty(shape, dtype=dtype, device=self.place)


@functools.lru_cache(maxsize=None)
def device_of(place):
    """The Device of tensors at this place."""
    if place.type != "cuda":
        raise error(Unsupported, f"run an operator on {place}", "its tensors are the CPU's or CUDA's",
                    f"given are some on {place}", "Move the tensors with tensor.cpu()")
    if os.environ.get("RETROGRADE_GPU") == "simulated":
        raise error(Unsupported, f"run an operator on {place}", "the simulated device has memory of its own",
                    'RETROGRADE_GPU is "simulated"', "Unset RETROGRADE_GPU, or move the tensors with tensor.cpu()")
    major, minor = torch.cuda.get_device_capability(place)
    return Device(place, 10 * major + minor)
