"""sides.py -- runs a computation several ways in turn (ours, PyTorch's eager and compiled code), for bench.py here and
in ../outside: the environment, tensors, errors against PyTorch in float64, and times.

PyTorch comes from the virtual environment of ../operators/peers.py, which is created if missing. malloc is set to keep
freed memory on all sides: otherwise page faults would take up to half of the time of large results, at random from run
to run.
"""
import contextlib
import ctypes
import json
import math
import os
import signal
import statistics
import sys
import time
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "operators"))
import peers  # noqa: E402

SIDES = ("retrograde", "eager", "compiled")
PAUSE_SECONDS = 0.03  # before a turn, because idle OpenMP threads spin for this long
WARM_SECONDS = 0.02  # of untimed runs in a turn, because after the pause caches are cold and clocks are low
MOST_SECONDS = 3  # for all rounds of a slow variant
KEPT_BYTES = str(1 << 33)  # memory that malloc keeps
CUDA_CALLS = 20  # per turn on a GPU, which works while the next call is issued


# ---- the environment ----

def add_options(parser, output):
    parser.add_argument("package")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--output", default=output)


def run_in_peers(threads):
    """Runs this program in the virtual environment and returns its exit status; None if this is that run already."""
    os.environ["HL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    if sys.prefix == peers.PEERS:
        return None
    peers.make_peers(["pytorch"])
    os.environ["MALLOC_MMAP_THRESHOLD_"], os.environ["MALLOC_TRIM_THRESHOLD_"] = KEPT_BYTES, KEPT_BYTES
    python = os.path.join(peers.PEERS, "bin", "python")
    return os.spawnv(os.P_WAIT, python, [python, *sys.argv])


def prepare(package, threads, device="cpu"):
    """Makes the package and PyTorch ready to run on this number of threads. Returns PyTorch's version."""
    sys.path.insert(0, os.path.abspath(package))
    warnings.filterwarnings("ignore")
    import torch

    torch.set_num_threads(threads)
    if device == "cpu":
        show_functions_to_compiled_code()
    return torch.__version__


def show_functions_to_compiled_code():
    """Code that torch.compile makes for exp, pow and similar calls uses functions of libtorch_cpu.so with which
    PyTorch 2.13's wheel does not link it."""
    import torch

    ctypes.CDLL(os.path.join(os.path.dirname(torch.__file__), "lib", "libtorch_cpu.so"), mode=ctypes.RTLD_GLOBAL)


@contextlib.contextmanager
def at_most(seconds):
    """Raises TimeoutError if the body takes longer; 0 means that it may take any time."""
    def stop(*_):
        raise TimeoutError(f"not done in {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


# ---- tensors and errors ----

def uniform(seed):
    """A function that draws tensors of random numbers, float64: values(*shape, low=0, high=1)."""
    import torch

    generator = torch.Generator().manual_seed(seed)

    def values(*shape, low=0.0, high=1.0):
        return low + (high - low) * torch.rand(shape, generator=generator, dtype=torch.float64)

    return values


def as_list(results):
    return list(results) if isinstance(results, (tuple, list)) else [results]


class Case:
    """The tensors of a computation, seeds for its results, and exact results and gradients, from PyTorch in float64.
    Gradients are those with respect to all inputs of real numbers but `constants`, a list of positions."""

    def __init__(self, formulation, inputs, constants=(), device="cpu"):
        import torch

        # Rounded before, so that all sides read the same numbers.
        inputs = [t.float().double() if t.is_floating_point() else t for t in inputs]
        self.wanted = [i for i, t in enumerate(inputs) if t.is_floating_point() and i not in constants]
        for i in self.wanted:
            inputs[i] = inputs[i].requires_grad_()
        results = as_list(formulation(*inputs))
        generator = torch.Generator().manual_seed(3)
        seeds = [2 * torch.rand(t.shape, generator=generator, dtype=torch.float64) - 1 for t in results]
        self.exact = [t.detach() for t in results]
        self.exact += torch.autograd.grad(results, [inputs[i] for i in self.wanted], seeds)
        self.seeds = [t.float().to(device) for t in seeds]
        # Numbers stay on the host.
        self.tensors = [self._rounded(t).to(device) if t.dim() else self._rounded(t) for t in inputs]
        for i in self.wanted:
            self.tensors[i] = self.tensors[i].requires_grad_()

    @staticmethod
    def _rounded(tensor):
        return tensor.detach().float() if tensor.is_floating_point() else tensor

    def errors(self, results):
        """The error of each result and gradient: the largest |a - b| / max(|b|, root mean square of b)."""
        return [relative_error(a, b) for a, b in zip(results, self.exact, strict=True)]


def relative_error(a, b):
    scale = b.square().mean().sqrt().clamp(min=1e-300)
    error = ((a.cpu().double() - b).abs() / b.abs().maximum(scale)).max().item()
    return math.inf if math.isnan(error) else error


# ---- times ----

class Side:
    """One way to compute, timed."""

    def __init__(self, name, function, case):
        self.name, self.function, self.case = name, function, case
        self.on_gpu = any(t.device.type != "cpu" for t in case.tensors)
        self.forward_ms, self.both_ms, self.spent = [], [], 0.0

    def forward(self):
        import torch

        with torch.no_grad():
            return self.function(*self.case.tensors)

    def both(self):
        import torch

        results = as_list(self.function(*self.case.tensors))
        wanted = [self.case.tensors[i] for i in self.case.wanted]
        return [*(t.detach() for t in results), *torch.autograd.grad(results, wanted, self.case.seeds)]

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


def measure(case, makers, rounds, most_first_seconds=None):
    """Runs what the makers return, by side, in turn. Returns a row of the report: errors, the time of the first calls
    including the maker's, medians, ratios of the better of PyTorch's two times to ours, and failures.
    `most_first_seconds` limits the time of the first calls of some sides."""
    most_first_seconds = most_first_seconds or {}
    row, failures, sides = {}, {}, []
    for name, make in makers.items():
        start = time.perf_counter()
        try:
            with at_most(most_first_seconds.get(name, 0)):
                side = Side(name, make(), case)
                results = side.both()
                side.forward()
            row[f"{name}_first_s"] = time.perf_counter() - start
            row[f"{name}_errors"] = case.errors(results)
            row[f"{name}_error"] = max(row[f"{name}_errors"])
            sides.append(side)
        except Exception as problem:  # the report contains what a side cannot do
            failures[name] = " ".join(f"{type(problem).__name__}: {problem}".split())[:600]
    for at in range(rounds):
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


# ---- reports ----

def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(v) for v in values))


def cells(row):
    """The times and errors of a row, for a line of text."""
    times = "".join(
        "  " + what + "".join(f"{row.get(f'{side}_{what}_ms', float('nan')):9.2f}" for side in SIDES)
        + f" ({row.get(what + '_ratio', 0):5.2f})" for what in ("forward", "both"))
    return times + "  errors " + " ".join(f"{row.get(f'{side}_error', float('nan')):.0e}" for side in SIDES)


def write(report, path):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(report, file, indent=1)
