#!/usr/bin/python3
"""pytorch_peers.py -- compares the gradients of this folder with PyTorch's, in one run.

    pytorch_peers.py WORKER [--program NAME] [--rounds N] [--threads N] [--small] [--output FILE]

WORKER is bench_kernels_retrograde, which implements ../pairs/worker_protocol.h. PyTorch runs in this
process, from the virtual environment of ../operators/operators.py, which is created if missing.
All run in turn, on the same inputs and number of threads. PyTorch's programs are written as its users
do: by the operators of torch.nn.functional where available, with autograd for the gradients, eagerly
and through torch.compile. PyTorch's time covers the forward and the backward pass (autograd needs
both); ours covers the gradients, including the values of the program that they need. Error: the
largest |ours - theirs| / max(|theirs|, root mean square), as in ../README.md; theirs is the eager one.
"""
import argparse
import json
import logging
import os
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "operators"))
import operators

try:
    import torch
except ImportError:
    if sys.prefix == operators.PEERS:
        raise
    operators.make_peers(["pytorch"])
    python = os.path.join(operators.PEERS, "bin", "python")
    os.execv(python, [python, *sys.argv])
import numpy as np
import torch.nn.functional as F


# ---- the inputs of kernel.h and gradient.cpp ----

def scrambled(n):
    n = n.astype(np.uint32)
    n = (n ^ (n >> np.uint32(16))) * np.uint32(0x7FEB352D)
    n = (n ^ (n >> np.uint32(15))) * np.uint32(0x846CA68B)
    return n ^ (n >> np.uint32(16))


def values(sizes, low, high):
    """A tensor whose last dimension is the first of `sizes`."""
    i = np.arange(int(np.prod(sizes)), dtype=np.int64)
    width, height = sizes[0], sizes[1] if len(sizes) > 1 else 1
    x, y, c = i % width, i // width % height, i // width // height
    ramp = (x * 5 + y * 3 + c * 91) % 1024
    wave = np.where(ramp < 512, ramp, 1023 - ramp)
    block = scrambled(x // 57 + y // 43 * 1031) & np.uint32(511)
    noise = scrambled(x + y * 8191 + c * 67108859) & np.uint32(255)
    v = ((wave + block + 0.25 * noise) / 1088.0).astype(np.float32)
    v = np.float32(low) + (np.float32(high) - np.float32(low)) * v
    return torch.from_numpy(v.reshape(sizes[::-1]))


def seed_of(output):
    n = scrambled(np.arange(output.numel(), dtype=np.int64) + 12345) >> np.uint32(8)
    return torch.from_numpy(n.astype(np.float32) / np.float32(8388608) - 1).reshape(output.shape)


# ---- the programs: inputs, and what they give ----

def convolution_layer(size):
    w, h, n = size(128, 13), size(128, 11), size(16, 3)
    inputs = [values((w + 2, h + 2, n), -1, 1), values((3, 3, n, n), -0.1, 0.1),
              values((n,), -0.1, 0.1)]
    return inputs, lambda image, weights, bias: torch.relu(F.conv2d(image[None], weights, bias))[0]


def bilateral_slice(size):
    w, h, cells, levels = size(512, 21), size(384, 17), 16, 8
    inputs = [values((cells + 1, cells + 1, levels + 1, 2), -1, 1), values((w, h), 0.01, 0.99)]
    x = (torch.arange(w) / w * 2 - 1).expand(h, w)
    y = (torch.arange(h) / h * 2 - 1)[:, None].expand(h, w)

    def program(grid, image):
        z = image.clamp(0, 0.999) * 2 - 1
        places = torch.stack([x, y, z], -1)[None, None]
        affine = F.grid_sample(grid[None], places, align_corners=True)[0, :, 0]
        return affine[0] * image + affine[1]

    return inputs, program


def deconvolution(size):
    w, h, side = size(512, 25), size(384, 19), 7
    inputs = [values((w, h), 0, 1), values((side, side), 0, 0.05)]
    return inputs, lambda image, kernel: F.conv2d(
        F.pad(image[None, None], [side // 2] * 4, mode="replicate"), kernel[None, None])[0, 0]


def scan(rows):
    """A recursive filter along the first dimension."""
    state, result = None, []
    for row in rows.unbind(0):
        state = row if state is None else 0.4 * row + 0.6 * state
        result.append(state)
    return torch.stack(result)


def recursive_filter(size):
    w, h = size(1024, 27), size(768, 22)
    return [values((w, h), 0, 1)], lambda image: scan(scan(image.t()).t())


def warp(size):
    w, h = size(512, 25), size(384, 19)
    inputs = [values((w, h), 0, 1), values((w, h, 2), -6, 6)]
    x, y = torch.arange(w, dtype=torch.float32), torch.arange(h, dtype=torch.float32)[:, None]

    def program(image, flow):
        u = (x + flow[0]).clamp(0, np.float32(w) - np.float32(1.01))
        v = (y + flow[1]).clamp(0, np.float32(h) - np.float32(1.01))
        places = torch.stack([u / (w - 1) * 2 - 1, v / (h - 1) * 2 - 1], -1)
        return F.grid_sample(image[None, None], places[None], align_corners=True)[0, 0]

    return inputs, program


def tone_curve(size):
    w, h, knots = size(1024, 27), size(768, 22), 64
    inputs = [values((w, h), 0.001, 0.998), values((knots + 1,), 0, 1)][::-1]

    def program(curve, image):
        at = image.clamp(0, 0.999) * knots
        i = at.floor().long().clamp(0, knots - 1)
        return torch.lerp(curve[i], curve[i + 1], at - at.floor())

    return inputs, program


def cross_entropy(size):
    samples, classes = size(16384, 37), size(32, 5)
    target = torch.arange(samples) % classes
    return [values((samples, classes), -3, 3)], lambda logits: F.cross_entropy(
        logits.t(), target, reduction="none")


def normalisation(size):
    w, h, n = size(256, 21), size(192, 13), size(16, 3)
    inputs = [values((w, h, n), -1, 2), values((n,), 0.5, 1.5), values((n,), -0.5, 0.5)]
    return inputs, lambda image, scale, shift: F.group_norm(image[None], n, scale, shift)[0]


def denoising(size):
    w, h = size(1024, 27), size(768, 22)
    noisy = values((w, h), 0, 1.1)

    def program(image):
        bounded = F.pad(image[None, None], [0, 1, 0, 1], mode="replicate")[0, 0]
        dx, dy = bounded[:-1, 1:] - image, bounded[1:, :-1] - image
        return (image - noisy) ** 2 + 0.1 * torch.sqrt(dx * dx + dy * dy + 1e-4)

    return [values((w, h), 0, 1)], program


def laplacian_pyramid(size):
    w, h, levels, border = size(512, 128), size(384, 96), 4, 16
    taps = torch.tensor([1.0, 2.0, 1.0]) / 4
    kernel = (taps[:, None] * taps)[None, None]

    def larger(image):
        for dim in (2, 3):
            after = torch.roll(image, -1, dim)
            image = torch.stack([image, (image + after) / 2], dim + 1).flatten(dim, dim + 1)
        return image

    def program(image, gain):
        gaussian = [F.pad(image[None, None], [border] * 4, mode="replicate")]
        for _ in range(levels - 1):
            gaussian.append(F.conv2d(gaussian[-1], kernel, stride=2, padding=1))
        result = gaussian[-1] * gain[levels - 1]
        for level in range(levels - 2, -1, -1):
            base = larger(gaussian[level + 1])
            result = larger(result) + (gaussian[level] - base) * gain[level]
        return result[0, 0, border:-border, border:-border]

    return [values((w, h), 0, 1), values((levels,), 0.5, 2.0)], program


PROGRAMS = [convolution_layer, bilateral_slice, deconvolution, recursive_filter, warp, tone_curve,
            cross_entropy, normalisation, denoising, laplacian_pyramid]


# ---- the sides ----

COMPILE_SECONDS = 60

class PyTorch:
    def __init__(self, program, small, compiled=False):
        inputs, self.program = program(lambda full, quick: quick if small else full)
        self.inputs = [x.requires_grad_() for x in inputs]
        with torch.no_grad():
            self.seed = seed_of(self.program(*self.inputs))
        if compiled:
            torch._dynamo.reset()
            self.program = torch.compile(self.program)

    def run(self):
        start = time.perf_counter()
        output = self.program(*self.inputs)
        self.gradients = torch.autograd.grad(output, self.inputs, self.seed)
        return time.perf_counter() - start


class Retrograde:
    def __init__(self, worker, program, small, threads):
        self.process = subprocess.Popen(
            [worker, program.__name__, "small" if small else "full", str(threads)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.answer("ready")

    def answer(self, expected):
        word, *rest = self.process.stdout.readline().split() or ["nothing"]
        if word != expected:
            raise RuntimeError(f"the worker said: {word} {' '.join(rest)}")
        return rest

    def ask(self, order, expected):
        self.process.stdin.write(order + "\n")
        self.process.stdin.flush()
        return self.answer(expected)

    def run(self):
        return float(self.ask("run", "ran")[0])

    def outputs(self):
        with tempfile.NamedTemporaryFile() as file:
            self.ask("save " + file.name, "saved")
            data, at, result = open(file.name, "rb").read(), 0, []
            while at < len(data):
                _, _, count = struct.unpack_from("<iiq", data, at)
                result.append(np.frombuffer(data, np.float32, count, at + 16).astype(np.float64))
                at += 16 + 4 * count
            return result

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def largest_error(ours, theirs):
    worst = 0.0
    for a, tensor in zip(ours, theirs):
        b = tensor.detach().numpy().astype(np.float64).ravel()
        scale = np.sqrt(np.mean(b * b))
        worst = max(worst, float(np.max(np.abs(a - b) / np.maximum(np.abs(b), scale))))
    return worst


def compiled_side(program, options):
    """(the program through torch.compile, None), or (None, the error) if it fails or takes over COMPILE_SECONDS.

    Scans take that long, because torch.compile turns them into one operator per row.
    """
    def too_long(*_):
        raise TimeoutError(f"not compiled within {COMPILE_SECONDS} s")

    logging.disable(logging.CRITICAL)  # silences the interrupted compiler
    before = signal.signal(signal.SIGALRM, too_long)
    signal.alarm(COMPILE_SECONDS)
    try:
        side = PyTorch(program, options.small, compiled=True)
        side.run()
        return side, None
    except Exception as failed:
        return None, str(failed).split("\n")[0]
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def run_in_turn(sides, rounds):
    times = [[] for _ in sides]
    for i in range(rounds):
        for k in range(len(sides)):
            at = (i + k) % len(sides)
            times[at].append(operators.last_of_turn(sides[at].run) * 1e3)
    return [statistics.median(t) for t in times]


def measure(program, options):
    theirs = PyTorch(program, options.small)
    compiled, failure = compiled_side(program, options)
    ours = Retrograde(options.worker, program, options.small, options.threads)
    theirs.run(), ours.run()
    a, b, *c = run_in_turn([ours, theirs] + ([compiled] if compiled else []), options.rounds)
    error = largest_error(ours.outputs(), theirs.gradients)
    ours.close()
    best = min([b, *c])
    c = c[0] if c else None
    print(f"{program.__name__:20} {a:10.2f} {b:10.2f} {format(c, '10.2f') if c else '         -'} "
          f"{a / best:8.3f} {error:10.1e}", flush=True)
    return {"program": program.__name__, "retrograde_ms": a, "pytorch_ms": b,
            "pytorch_compiled_ms": c, "compile_failure": failure, "ratio": a / best,
            "max_relative_error": error}


def main():
    parser = argparse.ArgumentParser(description="Gradients beside PyTorch's.")
    parser.add_argument("worker")
    parser.add_argument("--program", choices=[p.__name__ for p in PROGRAMS])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--output")
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    print(f"PyTorch {torch.__version__}, {options.threads} threads")
    print(f"{'program':20} {'ours ms':>10} {'PyTorch':>10} {'compiled':>10} {'ratio':>8} {'error':>10}")
    rows = [measure(p, options) for p in PROGRAMS
            if options.program in (None, p.__name__)]
    mean = float(np.exp(np.mean([np.log(r["ratio"]) for r in rows])))
    print(f"geometric mean of ratios {mean:.3f}")
    if options.output:
        with open(options.output, "w", encoding="utf-8") as file:
            json.dump({"pytorch": torch.__version__, "threads": options.threads,
                       "programs": rows, "geometric_mean": mean}, file, indent=2)


if __name__ == "__main__":
    main()
