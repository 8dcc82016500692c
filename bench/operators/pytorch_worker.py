#!/usr/bin/env python3
"""pytorch_worker.py -- one operator and its gradients by PyTorch, run on request.

    pytorch_worker.py OPERATOR eager|compiled|float64 THREADS INPUTS RANK SIZES... RANK SIZES...

A worker as ../pairs/worker_protocol.h says, in PyTorch's eager mode or through torch.compile, on the
inputs that a worker of the benchmark has saved. In float64 it is the reference:

    driver  errors PATH    worker  errors LARGEST NORM LARGEST NORM...    for each output saved there

LARGEST is the largest |a - b| / max(|b|, root mean square of b), NORM is |a - b| / |b|. Programs are
what users of PyTorch write: the operators of torch.nn.functional where there is one, autograd for
the gradients.
"""
import ctypes
import gc
import struct
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

PROGRAMS = {}


def program(by):
    """Gradients are by the first `by` of its arguments."""
    def register(function):
        PROGRAMS[function.__name__] = function, by
        return function
    return register


# ---- the operators; dimensions are in the reverse order of the .cpp files ----

@program(by=3)
def conv2d(image, weights, bias):
    return F.conv2d(image, weights, bias, padding=1)


# ---- the worker ----

def arrays(path):
    """Those in a file of OutputHeaders and elements."""
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


def errors(a, b):
    difference = np.abs(a.astype(np.float64) - b)
    size = np.linalg.norm(b)
    scale = size / np.sqrt(b.size)
    largest = np.max(difference / np.maximum(np.maximum(np.abs(b), scale), np.finfo(float).tiny))
    return largest, np.linalg.norm(difference) / max(size, np.finfo(float).tiny)


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

    def errors(self, path):
        pairs = zip(arrays(path), self.results)
        each = (e for a, b in pairs for e in errors(a, b.detach().numpy().ravel()))
        print("errors", *each, flush=True)


def main():
    name, mode, threads, path, *sizes = sys.argv[1:]
    torch.set_num_threads(int(threads))
    start = time.perf_counter()
    worker = Worker(name, mode, path, [int(n) for n in sizes])
    print("ready", time.perf_counter() - start, 0, 0, 0, flush=True)
    for line in sys.stdin:
        order, *words = line.split()
        {"run": worker.run, "memory": worker.memory, "errors": worker.errors}[order](*words)


if __name__ == "__main__":
    try:
        main()
    except Exception as error:  # what the benchmark shall show, whatever it is
        print("failed", type(error).__name__, " ".join(str(error).split()), flush=True)
        sys.exit(1)
