#!/usr/bin/env python3
"""pytorch_worker.py -- runs one operator and its gradients in PyTorch, on request.

    pytorch_worker.py OPERATOR eager|compiled|float64 THREADS INPUTS RANK SIZES... RANK SIZES...

It implements ../pairs/worker_protocol.h, in PyTorch's eager mode or through torch.compile, on inputs saved by
a worker of the benchmark. In float64 it is the reference. Programs are written as PyTorch users do: by the
operators of torch.nn.functional where available, with autograd for the gradients. Programs that are also
operators of ../torch are in its formulations.py.
"""
import ctypes
import gc
import struct
import sys
import time
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

sys.path.append(str(Path(__file__).resolve().parents[1] / "torch"))
import formulations

PROGRAMS = {}


def program(by):
    """Registers a program with gradients with respect to its first `by` arguments."""
    def register(function):
        PROGRAMS[function.__name__] = function, by
        return function
    return register


# ---- the operators; dimensions are in the reverse order of the .cpp files ----

program(by=3)(formulations.bilateral_slice)
program(by=2)(formulations.spatial_transformer)
program(by=2)(formulations.flow_warp)


@program(by=3)
def conv2d(image, weights, bias):
    return formulations.convolution(image, weights, bias)


@program(by=2)
def gamma_mse(image, gamma, target):
    return F.mse_loss(image ** gamma, target)


@program(by=4)
def deconvolution_step(image, kernel, weights, bank, blurred):
    explained = F.conv2d(image[None, None], kernel[None, None], padding=5)[0, 0]
    filtered = F.conv2d(image[None, None], bank[:, None], padding=1)[0]
    return ((explained - blurred) ** 2).sum() + (weights * (filtered ** 2).sum((1, 2))).sum()


def neighbours(image):
    """The east, west, south and north neighbours of each pixel."""
    padded = F.pad(image[None], [1, 1, 1, 1], mode="replicate")[0]
    return padded[:, 1:-1, 2:], padded[:, 1:-1, :-2], padded[:, 2:, 1:-1], padded[:, :-2, 1:-1]


@program(by=3)
def fluid_step(velocity, force, density, target):
    driven = diffused = velocity + 0.5 * force
    for _ in range(20):
        diffused = (driven + 0.2 * sum(neighbours(diffused))) * (1 / (1 + 4 * 0.2))
    carried = formulations.flow_warp(diffused, -0.5 * diffused)
    east, west, south, north = neighbours(carried)
    divergence = 0.5 * ((east - west)[0:1] + (south - north)[1:2])
    pressure = -0.25 * divergence
    for _ in range(19):
        pressure = 0.25 * (sum(neighbours(pressure)) - divergence)
    east, west, south, north = neighbours(pressure)
    final = carried - 0.5 * torch.cat([east - west, south - north])
    return ((formulations.flow_warp(density[None], -0.5 * final)[0] - target) ** 2).sum()


@program(by=5)
def separable_block(image, depthwise, depthwise_bias, pointwise, pointwise_bias):
    channels = len(depthwise)
    inner = F.relu(F.conv2d(image, depthwise[:, None], depthwise_bias, padding=1, groups=channels))
    return F.relu(F.conv2d(inner, pointwise[:, :, None, None], pointwise_bias))


@program(by=3)
def attention(query, key, value):
    return F.scaled_dot_product_attention(query[None], key[None], value[None], is_causal=True)[0]


@program(by=1)
def laplacian_loss(image, target):
    taps = torch.tensor([1.0, 3.0, 3.0, 1.0], dtype=image.dtype) / 8
    kernel = (taps[:, None] * taps)[None, None]
    rest, loss = (image - target)[None, None], 0
    for level in range(8):
        detail = rest
        if level < 7:
            rest = F.conv2d(F.pad(rest, [1, 1, 1, 1], mode="replicate"), kernel, stride=2)
            detail = detail - F.interpolate(rest, scale_factor=2, mode="bilinear")
        loss = loss + 2 ** level * torch.sqrt(detail ** 2 + 1e-4).mean()
    return loss


@program(by=3)
def bilateral_smoothing(values, confidence, strength):
    state = values
    weight = 1 / (confidence + 6 * strength)
    for _ in range(30):
        p = F.pad(state[None, None], [1] * 6, mode="replicate")[0, 0]
        around = (p[1:-1, 1:-1, 2:] + p[1:-1, 1:-1, :-2] + p[1:-1, 2:, 1:-1] + p[1:-1, :-2, 1:-1] +
                  p[2:, 1:-1, 1:-1] + p[:-2, 1:-1, 1:-1])
        state = (confidence * values + strength * around) * weight
    return state


@program(by=2)
def non_local_means(image, strength):
    return formulations.non_local_means(image, strength, patch=7, search=11)


# ---- the worker ----

def arrays(path):
    """The arrays in a file of OutputHeaders and elements."""
    with open(path, "rb") as file:
        data, at = file.read(), 0
    while at < len(data):
        count = struct.unpack_from("<iiq", data, at)[2]
        yield np.frombuffer(data, np.float32, count, at + 16)
        at += 16 + 4 * count


def shapes(numbers):
    while numbers:
        rank = numbers[0]
        yield numbers[rank:0:-1]
        numbers = numbers[rank + 1:]


def status_mb(field):
    with open("/proc/self/status", encoding="utf-8") as file:
        return next(int(line.split()[1]) / 1024 for line in file if line.startswith(field + ":"))


class Worker:
    def __init__(self, name, mode, path, sizes):
        self.program, by = PROGRAMS[name]
        kind = torch.float64 if mode == "float64" else torch.float32
        *inputs, self.seed = (torch.from_numpy(a.copy()).reshape(shape).to(kind)
                              for a, shape in zip(arrays(path), shapes(sizes)))
        self.by = [x.requires_grad_() for x in inputs[:by]]
        self.inputs = inputs
        if mode == "compiled":
            self.program = torch.compile(self.program)
        self.results = self.step()

    def step(self):
        output = self.program(*self.inputs)
        return *torch.autograd.grad(output, self.by, self.seed), output.detach()

    def run(self):
        self.results = None
        start = time.perf_counter()
        self.results = self.step()
        print("ran", time.perf_counter() - start, flush=True)

    def memory(self):
        self.results = None
        gc.collect()
        ctypes.CDLL("libc.so.6").malloc_trim(0)
        peak, before = status_mb("VmHWM"), status_mb("VmRSS")
        with open("/proc/self/clear_refs", "w", encoding="utf-8") as file:
            file.write("5")
        self.results = self.step()
        print("memory", max(peak, status_mb("VmHWM")), status_mb("VmHWM") - before, flush=True)

    def save(self, path):
        with open(path, "wb") as file:
            for result in self.results:
                values = result.numpy()
                file.write(struct.pack("<iiq", 2, 8 * values.itemsize, values.size))
                file.write(values.tobytes())
        print("saved", flush=True)


def main():
    name, mode, threads, path, *sizes = sys.argv[1:]
    torch.set_num_threads(int(threads))
    start = time.perf_counter()
    worker = Worker(name, mode, path, [int(n) for n in sizes])
    print("ready", time.perf_counter() - start, 0, 0, 0, flush=True)
    for line in sys.stdin:
        order, *words = line.split()
        {"run": worker.run, "memory": worker.memory, "save": worker.save}[order](*words)


if __name__ == "__main__":
    try:
        main()
    except Exception as error:  # reported by the benchmark, whatever it is
        print("failed", type(error).__name__, " ".join(str(error).split()), flush=True)
        sys.exit(1)
