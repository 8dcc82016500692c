#!/usr/bin/python3
"""bench.py -- compares eight PyTorch operators made from pipelines with PyTorch's own, in one run.

    bench.py PACKAGE [--operator NAME]... [--rounds N] [--threads N] [--small] [--output FILE] [--plot FILE]
             [--device cuda]

PACKAGE is the folder that contains the Python package. PyTorch comes from the virtual environment of
../operators/peers.py, which is created if missing. PyTorch's formulations (formulations.py) run eagerly and through
torch.compile. All run in turn, on the same tensors and number of threads: forward only, and forward with backward
with respect to all inputs. Errors are the largest |a - b| / max(|b|, root mean square of b) over the result and all
gradients, where b is PyTorch's result in float64. `ratio` is the time of PyTorch's faster variant divided by ours.
The last rows are the overhead of a call without work (overhead.py). malloc is set to keep freed memory on all sides:
otherwise page faults would take up to half of the time of large results, at random from run to run.

--device cuda: everything runs on the GPU, with the PyTorch of the interpreter that runs this. A turn is CUDA_CALLS
calls and the end of the last one.
"""
import argparse
import ctypes
import json
import math
import os
import statistics
import sys
import time
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "operators")]
import overhead
import peers

SIDES = ("retrograde", "eager", "compiled")
PAUSE_SECONDS = 0.03  # before a turn, because idle OpenMP threads spin for this long
WARM_SECONDS = 0.02  # of untimed runs in a turn, because after the pause caches are cold and clocks are low
MOST_SECONDS = 3  # for all rounds of a slow variant
KEPT_BYTES = str(1 << 33)  # memory that malloc keeps
CUDA_CALLS = 20  # per turn on a GPU, which works while the next call is issued


def sized(small):
    """The inputs of each operator, float64."""
    import torch

    generator = torch.Generator().manual_seed(7)

    def values(*shape, low=0.0, high=1.0):
        return low + (high - low) * torch.rand(shape, generator=generator, dtype=torch.float64)

    n = 64 if small else 512
    turn = torch.tensor([[0.9, -0.2, 0.05], [0.2, 0.9, -0.03]], dtype=torch.float64)
    return {
        "bilateral_slice": (values(3, 2 * n, 2 * n), values(2 * n, 2 * n), values(3, 4, 8, 16, 16, low=-1)),
        "flow_warp": (values(16, n, n, low=-1), values(2, n, n, low=-9, high=9)),
        "spatial_transformer": (values(4, 16, n, n, low=-1), turn + 0.03 * torch.arange(4.0)[:, None, None]),
        "convolution": (values(4, 16, n // 2, n // 2, low=-1), values(16, 16, 3, 3, low=-0.2, high=0.2), values(16)),
        "tone_curve": (values(2 * n, 2 * n), values(65)),
        "recursive_filter": (values(2 * n, 2 * n), torch.tensor(0.4, dtype=torch.float64)),
        "non_local_means": (values(n, n), torch.tensor(9.0, dtype=torch.float64)),
        "soft_histogram": (values(2 * n, 2 * n),),
    }


class Side:
    """One way to compute an operator, timed."""

    def __init__(self, name, function, tensors, device):
        self.name, self.function, self.tensors = name, function, tensors
        self.on_gpu = device != "cpu"
        self.forward_ms, self.both_ms, self.spent = [], [], 0.0

    def forward(self):
        import torch

        with torch.no_grad():
            return self.function(*self.tensors)

    def both(self):
        import torch

        result = self.function(*self.tensors)
        return [result.detach(), *torch.autograd.grad(result, self.tensors, self.seed)]

    def wait(self):
        import torch

        if self.on_gpu:
            torch.cuda.synchronize()

    def timed(self, run, times):
        if self.spent > MOST_SECONDS and times:
            return
        time.sleep(PAUSE_SECONDS)
        warm = time.perf_counter()
        calls = CUDA_CALLS if self.on_gpu else 1
        while True:
            start = time.perf_counter()
            for _ in range(calls):
                run()
            self.wait()
            end = time.perf_counter()
            if end - warm > WARM_SECONDS:
                break
        times.append(1e3 * (end - start) / calls)
        self.spent += end - warm


def show_functions_to_compiled_code():
    """Code that torch.compile makes for exp, pow and similar calls uses functions of libtorch_cpu.so with which
    PyTorch 2.13's wheel does not link it."""
    import torch

    ctypes.CDLL(os.path.join(os.path.dirname(torch.__file__), "lib", "libtorch_cpu.so"), mode=ctypes.RTLD_GLOBAL)


def largest_error(results, exact):
    worst = 0.0
    for a, b in zip(results, exact):
        scale = b.square().mean().sqrt().clamp(min=1e-300)
        worst = max(worst, ((a.cpu().double() - b).abs() / b.abs().maximum(scale)).max().item())
    return worst


def measure(name, options):
    import torch
    from definitions import OPERATORS
    from formulations import FORMULATIONS
    from retrograde.torch import operator

    exact_inputs = [t.requires_grad_() for t in sized(options.small)[name]]
    exact = FORMULATIONS[name](*exact_inputs)
    seed = 2 * torch.rand(exact.shape, generator=torch.Generator().manual_seed(3), dtype=torch.float64) - 1
    exact = [exact.detach(), *torch.autograd.grad(exact, exact_inputs, seed)]
    # Numbers stay on the host.
    tensors = [(t.detach().float().to(options.device) if t.dim() else t.detach().float()).requires_grad_()
               for t in exact_inputs]
    functions = {"retrograde": operator(f"bench::{name}", OPERATORS[name]), "eager": FORMULATIONS[name],
                 "compiled": torch.compile(FORMULATIONS[name], fullgraph=True, dynamic=False)}
    sides = [Side(side, functions[side], tensors, options.device) for side in SIDES]
    row, failures = {"operator": name, "sizes": [list(t.shape) for t in tensors]}, {}
    for side in list(sides):
        side.seed = seed.float().to(options.device)
        start = time.perf_counter()
        try:
            row[f"{side.name}_error"] = largest_error(side.both(), exact)
            side.forward()
            row[f"{side.name}_first_s"] = time.perf_counter() - start
        except Exception as problem:  # the report contains what a peer cannot do
            failures[side.name] = " ".join(str(problem).split())[:400]
            sides.remove(side)
    for at in range(options.rounds):
        for i in range(len(sides)):
            side = sides[(i + at) % len(sides)]
            side.timed(side.forward, side.forward_ms)
            side.timed(side.both, side.both_ms)
    for side in sides:
        row[f"{side.name}_forward_ms"] = statistics.median(side.forward_ms)
        row[f"{side.name}_both_ms"] = statistics.median(side.both_ms)
    row["failures"] = failures
    for what in ("forward", "both"):
        theirs = [row[f"{s}_{what}_ms"] for s in ("eager", "compiled") if f"{s}_{what}_ms" in row]
        if theirs and f"retrograde_{what}_ms" in row:
            row[f"{what}_ratio"] = min(theirs) / row[f"retrograde_{what}_ms"]
    return row


def plot(report, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = report["operators"]
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4), sharey=True)
    for axis, what, title in zip(axes, ("forward", "both"), ("forward", "forward and backward")):
        for i, side in enumerate(("retrograde", "eager", "compiled")):
            axis.barh([y + 0.27 * (1 - i) for y in range(len(rows))], [r.get(f"{side}_{what}_ms", 0) for r in rows],
                      0.25, label={"retrograde": "Retrograde", "eager": "PyTorch", "compiled": "torch.compile"}[side])
        axis.set_xscale("log")
        axis.set_xlabel(f"{title}, ms")
        axis.set_yticks(range(len(rows)), [r["operator"] for r in rows])
    axes[0].invert_yaxis()
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(v) for v in values))


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("package")
    parser.add_argument("--operator", action="append", dest="operators")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--output", default="out/bench/torch.json")
    parser.add_argument("--plot")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    return parser.parse_args()


def main():
    options = read_options()
    os.environ["HL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(options.threads)
    if options.device == "cpu" and sys.prefix != peers.PEERS:
        peers.make_peers(["pytorch"])
        os.environ["MALLOC_MMAP_THRESHOLD_"], os.environ["MALLOC_TRIM_THRESHOLD_"] = KEPT_BYTES, KEPT_BYTES
        python = os.path.join(peers.PEERS, "bin", "python")
        done = os.spawnv(os.P_WAIT, python, [python, *sys.argv])
        if done == 0 and options.plot:  # with Debian's matplotlib
            with open(options.output, encoding="utf-8") as file:
                plot(json.load(file), options.plot)
        sys.exit(done)
    sys.path.insert(0, os.path.abspath(options.package))
    warnings.filterwarnings("ignore")
    import torch

    torch.set_num_threads(options.threads)
    if options.device == "cpu":
        show_functions_to_compiled_code()
    report = {"pytorch": torch.__version__, "threads": options.threads, "operators": []}
    place = f"{options.threads} threads"
    if options.device == "cuda":
        torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
        place = report["device"] = torch.cuda.get_device_name()
    print(f"PyTorch {torch.__version__}, {place}; ms: ours, eager, torch.compile")
    for name in options.operators or sized(True):
        row = measure(name, options)
        report["operators"].append(row)
        with open(options.output, "w", encoding="utf-8") as file:
            json.dump(report, file, indent=1)
        cells = "".join(
            "  " + what + "".join(f"{row.get(f'{side}_{what}_ms', float('nan')):9.2f}" for side in SIDES)
            + f" ({row.get(what + '_ratio', 0):5.2f})" for what in ("forward", "both"))
        errors = " ".join(f"{row.get(f'{side}_error', float('nan')):.0e}" for side in SIDES)
        print(f"{name:20}{cells}  errors {errors}", *row["failures"].items(), flush=True)
    if not options.operators and options.device == "cpu":
        report["overhead_us"] = overhead.measure()
        overhead.show(report["overhead_us"])
    for what in ("forward", "both"):
        ratios = [row[f"{what}_ratio"] for row in report["operators"] if f"{what}_ratio" in row]
        report[f"{what}_geometric_mean"] = geometric_mean(ratios)
        print(f"{what}: geometric mean {report[f'{what}_geometric_mean']:.2f}, least {min(ratios):.2f}")
    with open(options.output, "w", encoding="utf-8") as file:
        json.dump(report, file, indent=1)


if __name__ == "__main__":
    main()
