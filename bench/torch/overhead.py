#!/usr/bin/python3
"""overhead.py -- the overhead of calling one of our operators compared with PyTorch's own, on tensors of one element.

    overhead.py PACKAGE [--from-cpp PREFIX] [--output FILE]

PACKAGE is the folder that contains the Python package. PREFIX is where Retrograde is installed: an operator made from
a generator is then also called from C++ (from_cpp/, built in out/bench/from_cpp). Runs with the interpreter's own
PyTorch, on one thread. Prints microseconds, the least of many rounds, in which all take turns. All operators add two
tensors. For comparison, it also measures PyTorch's cost of an operator that only allocates its result: as a Python
function registered with torch.library, and as an autograd.Function that saves its inputs.
"""
import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROUNDS, CALLS = 200, 40


def _native():
    import torch

    return torch.add


def _ours(knows_sizes):
    import retrograde as rg
    from retrograde.torch import operator

    def define(kind, shapes=None):
        x, total = rg.Var("x"), rg.Func("total")
        a, b = rg.ImageParam(kind, 1, "a"), rg.ImageParam(kind, 1, "b")
        total[x] = a[x] + b[x]
        return total, [a, b]

    if knows_sizes:
        return operator("overhead::total", define)
    return operator("overhead::total_of_any_sizes", lambda kind: define(kind))


def _empty_operator():
    import torch

    library = torch.library.Library("overhead_empty", "DEF")
    library.define("result(Tensor a, Tensor b) -> Tensor")
    library.impl("result", lambda a, b: torch.empty((1,)), "CPU")

    class Empty(torch.autograd.Function):
        @staticmethod
        def forward(ctx, a, b):
            ctx.save_for_backward(a, b)
            return torch.empty((1,))

        @staticmethod
        def backward(ctx, seed):
            return None, seed

    def autograd(a, b):
        return Empty.apply(a, b) if a.requires_grad or b.requires_grad else torch.empty((1,))

    library.impl("result", autograd, "Autograd")
    _empty_operator.kept = library
    return torch.ops.overhead_empty.result.default, Empty.apply


def measure():
    """{called function: {variant: us}}."""
    import torch

    registered, function = _empty_operator()
    calls = {"PyTorch": _native(), "ours": _ours(True), "ours of any sizes": _ours(False),
             "an empty operator": registered, "an empty autograd.Function": function}
    a, b, wanting = torch.rand(1), torch.rand(1), torch.rand(1, requires_grad=True)

    def both(call):
        wanting.grad = None
        call(a, wanting).backward()

    ways = {"forward": lambda call: call(a, b), "forward, gradient wanted": lambda call: call(a, wanting),
            "forward and backward": both}
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    best = {name: dict.fromkeys(ways, float("inf")) for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            for way, run in ways.items():
                run(call)
                start = time.perf_counter()
                for _ in range(CALLS):
                    run(call)
                best[name][way] = min(best[name][way], 1e6 * (time.perf_counter() - start) / CALLS)
    torch.set_num_threads(threads)
    return best


def measure_from_cpp(prefix):
    """The same for calls from C++, with the PyTorch of this interpreter."""
    source = Path(__file__).resolve().parent / "from_cpp"
    build = source.parents[2] / "out/bench/from_cpp"
    for command in (["cmake", "-S", source, "-B", build, "-G", "Ninja", f"-DPYTHON={sys.executable}",
                     f"-DCMAKE_PREFIX_PATH={Path(prefix).resolve()}"], ["cmake", "--build", build]):
        made = subprocess.run(command, capture_output=True, text=True)
        if made.returncode != 0:
            raise SystemExit(f"cannot build {source} with {prefix}:\n{made.stdout[-2000:]}{made.stderr[-2000:]}")
    return json.loads(subprocess.check_output([build / "calls", build / "total.so"]))


def show(report):
    ways = list(report["PyTorch"])
    print(f"{'us for a call on one element':32}" + "".join(f"{way:>34}" for way in ways))
    for name, row in report.items():
        over = {way: f"{row[way]:.2f} ({row[way] - report['PyTorch'][way]:+.2f})" for way in ways}
        print(f"{name:32}" + "".join(f"{over[way]:>34}" for way in ways))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("package")
    parser.add_argument("--from-cpp", metavar="PREFIX")
    parser.add_argument("--output")
    options = parser.parse_args()
    sys.path.insert(0, os.path.abspath(options.package))
    import torch

    print(f"PyTorch {torch.__version__}")
    report = measure()
    show(report)
    result = {"pytorch": torch.__version__, "overhead_us": report}
    if options.from_cpp:
        print("from C++")
        result["overhead_from_cpp_us"] = measure_from_cpp(options.from_cpp)
        show(result["overhead_from_cpp_us"])
    if options.output:
        with open(options.output, "w", encoding="utf-8") as file:
            json.dump(result, file, indent=1)


if __name__ == "__main__":
    main()
