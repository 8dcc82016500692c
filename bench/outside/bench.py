#!/usr/bin/python3
"""bench.py -- programs that the compiler was not built for, called as PyTorch operators, compared with PyTorch.

    bench.py PACKAGE [--program NAME]... [--rounds N] [--threads N] [--small] [--compile-seconds S] [--explain]
             [--output FILE]

PACKAGE is the folder that contains the Python package. Each program runs in a process of its own, so that a crash is a
row of the report. All sides run in turn on the same tensors (../torch/sides.py). A row fails if our side is
refused, crashes or exceeds the program's error; the exit status is then 1. torch.compile unrolls loops of Python; where
it takes longer than --compile-seconds (0: leave it out), only eager PyTorch is compared. --explain prints the schedule
of each program, and what our operator says about its gradients if it can.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "torch")]
import sides

SEED = 11
MOST_SECONDS = 900  # for a program


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sides.add_options(parser, "out/bench/outside.json")
    parser.add_argument("--program", action="append", dest="programs")
    parser.add_argument("--compile-seconds", type=int, default=120)
    parser.add_argument("--explain", action="store_true")
    parser.add_argument("--row", help=argparse.SUPPRESS)  # this process runs one program and writes its row here
    return parser.parse_args()


def warm_up(has_compiled):
    """Initialises the compilers, so that the programs do not pay for it."""
    import torch

    import retrograde as rg
    from retrograde.torch import operator

    x, image, f = rg.Var("x"), rg.ImageParam("float32", 1, "image"), rg.Func("f")
    f[x] = image[x] * image[x]
    operator("outside::warm_up", lambda kind, _: (f, [image]))(torch.ones(8, requires_grad=True)).sum().backward()
    if has_compiled:
        torch.compile(lambda t: t * t)(torch.ones(8, requires_grad=True)).sum().backward()


def explain(operator, program, shapes):
    import retrograde as rg

    outputs = program.define(*shapes)[0]
    print(rg.Pipeline(sides.as_list(outputs)).explain_schedule())
    if hasattr(operator, "explain"):
        print(operator.explain())


def failure_of(row, program):
    """What is wrong with our side, or None."""
    if "retrograde" in row["failures"]:
        return row["failures"]["retrograde"]
    if row["retrograde_error"] > program.tolerance:
        return f"error {row['retrograde_error']:.1e} exceeds {program.tolerance:.0e}"
    return None


def measure(program, options):
    import torch

    warm_up(options.compile_seconds > 0)
    case = sides.Case(program.pytorch, program.inputs(sides.uniform(SEED), options.small), program.constants)
    shapes = [tuple(t.shape) for t in case.tensors]
    row, made = {"program": program.name, "field": program.__module__, "sizes": shapes}, []

    def make():
        made.append(program.operator(shapes, "outside"))
        return made[0]

    makers = {"retrograde": make, "eager": lambda: program.pytorch}
    if options.compile_seconds:
        makers["compiled"] = lambda: torch.compile(program.pytorch, fullgraph=True, dynamic=False)
    row.update(sides.measure(case, makers, options.rounds, {"compiled": options.compile_seconds}))
    row["failure"] = failure_of(row, program)
    if options.explain and made:
        explain(made[0], program, shapes)
    return row


def row_of(name, options):
    """The row of a program, from a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "row.json")
        command = [sys.executable, __file__, options.package, "--program", name, "--row", path,
                   "--rounds", str(options.rounds), "--threads", str(options.threads),
                   "--compile-seconds", str(options.compile_seconds)]
        command += ["--small"] * options.small + ["--explain"] * options.explain
        try:
            status = subprocess.run(command, timeout=MOST_SECONDS).returncode
        except subprocess.TimeoutExpired:
            status = f"nothing in {MOST_SECONDS} s"
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                return json.load(file)
        from programs import FIELD_OF

        return {"program": name, "field": FIELD_OF[name], "failures": {}, "failure": f"its process ended with {status}"}


def add_means(report, held_out):
    """Adds geometric means and counts: of all programs, of those held out, and of the others. Failed programs
    are counted; their ratios are not."""
    rows = report["programs"]
    groups = {"all": rows, "held_out": [r for r in rows if r["program"] in held_out],
              "others": [r for r in rows if r["program"] not in held_out]}
    report["means"] = {}
    for group, members in groups.items():
        mean = report["means"][group] = {"programs": len(members), "failures": sum(bool(r["failure"]) for r in members)}
        for what in ("forward", "both"):
            ratios = [r[f"{what}_ratio"] for r in members if f"{what}_ratio" in r and not r["failure"]]
            if ratios:
                mean[what] = sides.geometric_mean(ratios)
                mean[f"{what}_below_1"], mean[f"{what}_below_0.7"] = (sum(v < limit for v in ratios)
                                                                      for limit in (1, 0.7))
    return report["means"]


def show(row):
    print(f"{row['program']:22}{sides.cells(row)}  first {row.get('retrograde_first_s', float('nan')):.1f} s",
          f"FAILED: {row['failure']}" if row["failure"] else "",
          *(f"{side}: {why[:160]}" for side, why in row["failures"].items() if side != "retrograde"), flush=True)


def main():
    options = read_options()
    status = sides.run_in_peers(options.threads)
    if status is not None:
        sys.exit(status)
    os.environ["TORCHINDUCTOR_COMPILE_THREADS"] = "1"  # no worker goes on when a compilation is given up
    version = sides.prepare(options.package, options.threads)
    from programs import HELD_OUT, PROGRAMS

    if options.row:
        sides.write(measure(PROGRAMS[options.programs[0]], options), options.row)
        return
    report = {"pytorch": version, "threads": options.threads, "held_out": HELD_OUT, "programs": []}
    print(f"PyTorch {version}, {options.threads} threads; ms: ours, eager, torch.compile (ratio)")
    for name in options.programs or PROGRAMS:
        row = row_of(name, options)
        report["programs"].append(row)
        show(row)
        add_means(report, HELD_OUT)
        sides.write(report, options.output)
    for group, mean in report["means"].items():
        figures = (f"{what} {mean[what]:.2f} ({mean[f'{what}_below_1']} below 1, {mean[f'{what}_below_0.7']} below 0.7)"
                   for what in ("forward", "both") if what in mean)
        print(f"{group}: {mean['programs']} programs, {mean['failures']} failed;", ", ".join(figures))
    sys.exit(any(row["failure"] for row in report["programs"]))


if __name__ == "__main__":
    main()
