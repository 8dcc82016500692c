"""The devices on which operators run besides the CPU: where their tensors are, what is compiled for them, and the stream
that all of it is put into.
"""
import contextlib
import functools
import os

import torch

from .. import _retrograde as rg
from .._errors import Unsupported, error

_KNOWN = 90, 86, 80, 75  # capabilities that code is made for


class Device:
    """`place`: where results are made; `target`: the text of what code is for."""

    def __init__(self, place, capability):
        known = next((c for c in _KNOWN if c <= capability), None)
        if known is None:
            raise error(Unsupported, f"run an operator on {place}", f"it has compute capability {_KNOWN[-1] / 10} or more",
                        f"its is {capability / 10}", "Move the tensors with tensor.cpu()")
        self.place, self.target = place, f"{rg.get_host_target()}-cuda-cuda_capability_{known}"

    def current(self):
        """Where calls find its context."""
        return torch.cuda.device(self.place)

    def stream(self):
        return torch.cuda.current_stream(self.place).cuda_stream


class SimulatedDevice(Device):
    """That of RETROGRADE_GPU=simulated, whose memory is the CPU's: kernels run on tensors of the CPU."""

    def __init__(self):
        super().__init__(torch.device("cpu"), _KNOWN[0])

    def current(self):
        return contextlib.nullcontext()

    def stream(self):
        return 0


@functools.lru_cache(maxsize=None)
def device_of(name, place):
    """Of tensors at this place."""
    if place.type != "cuda":
        raise error(Unsupported, f'call the operator "{name}"', "its tensors are the CPU's or CUDA's",
                    f"given are some on {place}", "Move the tensors with tensor.cpu()")
    if os.environ.get("RETROGRADE_GPU") == "simulated":
        raise error(Unsupported, f'call the operator "{name}" on {place}', "the simulated device has its own memory",
                    "RETROGRADE_GPU is \"simulated\"", "Unset RETROGRADE_GPU, or move the tensors with tensor.cpu()")
    major, minor = torch.cuda.get_device_capability(place)
    return Device(place, 10 * major + minor)
