#!/usr/bin/python3
"""bench.py -- compares eight PyTorch operators made from pipelines with PyTorch's own, in one run.

    bench.py PACKAGE [--operator NAME]... [--rounds N] [--threads N] [--small] [--output FILE] [--plot FILE]
             [--device cuda]

PACKAGE is the folder that contains the Python package. PyTorch's formulations (formulations.py) run eagerly and through
torch.compile. All run in turn, on the same tensors and number of threads: forward only, and forward with backward
with respect to all inputs (sides.py). Errors are the largest |a - b| / max(|b|, root mean square of b) over the result
and all gradients, where b is PyTorch's result in float64. `ratio` is the time of PyTorch's faster variant divided by
ours. The last rows are the overhead of a call without work (overhead.py).

--device cuda: everything runs on the GPU, with the PyTorch of the interpreter that runs this. A turn is CUDA_CALLS
calls and the end of the last one.
"""
import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import overhead
import sides


def sized(small):
    """The inputs of each operator, float64."""
    import torch

    values, n = sides.uniform(7), 64 if small else 512
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


def measure(name, options):
    import torch
    from definitions import OPERATORS
    from formulations import FORMULATIONS
    from retrograde.torch import operator

    formulation = FORMULATIONS[name]
    case = sides.Case(formulation, sized(options.small)[name], device=options.device)
    row = sides.measure(case, {
        "retrograde": lambda: operator(f"bench::{name}", OPERATORS[name]), "eager": lambda: formulation,
        "compiled": lambda: torch.compile(formulation, fullgraph=True, dynamic=False)}, options.rounds)
    return {"operator": name, "sizes": [list(t.shape) for t in case.tensors], **row}


def plot(report, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = report["operators"]
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4), sharey=True)
    for axis, what, title in zip(axes, ("forward", "both"), ("forward", "forward and backward")):
        for i, side in enumerate(sides.SIDES):
            axis.barh([y + 0.27 * (1 - i) for y in range(len(rows))], [r.get(f"{side}_{what}_ms", 0) for r in rows],
                      0.25, label={"retrograde": "Retrograde", "eager": "PyTorch", "compiled": "torch.compile"}[side])
        axis.set_xscale("log")
        axis.set_xlabel(f"{title}, ms")
        axis.set_yticks(range(len(rows)), [r["operator"] for r in rows])
    axes[0].invert_yaxis()
    axes[0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sides.add_options(parser, "out/bench/torch.json")
    parser.add_argument("--operator", action="append", dest="operators")
    parser.add_argument("--plot")
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    return parser.parse_args()


def main():
    options = read_options()
    done = sides.run_in_peers(options.threads) if options.device == "cpu" else None
    if done is not None:
        if done == 0 and options.plot:  # with Debian's matplotlib
            with open(options.output, encoding="utf-8") as file:
                plot(json.load(file), options.plot)
        sys.exit(done)
    report = {"pytorch": sides.prepare(options.package, options.threads, options.device), "threads": options.threads,
              "operators": []}
    place = f"{options.threads} threads"
    if options.device == "cuda":
        import torch

        torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
        place = report["device"] = torch.cuda.get_device_name()
    print(f"PyTorch {report['pytorch']}, {place}; ms: ours, eager, torch.compile")
    for name in options.operators or sized(True):
        row = measure(name, options)
        report["operators"].append(row)
        sides.write(report, options.output)
        print(f"{name:20}{sides.cells(row)}", *row["failures"].items(), flush=True)
    if not options.operators and options.device == "cpu":
        report["overhead_us"] = overhead.measure()
        overhead.show(report["overhead_us"])
    for what in ("forward", "both"):
        ratios = [row[f"{what}_ratio"] for row in report["operators"] if f"{what}_ratio" in row]
        report[f"{what}_geometric_mean"] = sides.geometric_mean(ratios)
        print(f"{what}: geometric mean {report[f'{what}_geometric_mean']:.2f}, least {min(ratios):.2f}")
    sides.write(report, options.output)


if __name__ == "__main__":
    main()
