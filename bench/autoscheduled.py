#!/usr/bin/env python3
"""autoscheduled.py -- compares our autoscheduler, Halide's autoschedulers and manual schedules on the kernels.

All of them take turns within one run.

    autoscheduled.py PROGRAMS [--kernel NAME]... [--rounds N] [--threads N] [--no-halide] [--output FILE]

PROGRAMS is the folder of bench_kernels_retrograde and bench_machine. Halide is the wheel from the Python
package index, as in operators/operators.py, with each of its autoschedulers and 60 s for search and
compilation. Results are checked against those of the manual schedules. README.md explains the figures.
"""
import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "operators"))
import operators  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
SCHEDULES = [s for s in operators.SCHEDULES if s != "root"]
MOST_ERROR = 1e-3  # relative to the norm


def kernel_names():
    with open(os.path.join(HERE, "list.def"), encoding="utf-8") as file:
        return re.findall(r"^KERNEL\((\w+)\)", file.read(), re.M)


def error_of(workers, scratch):
    """The largest error of the autoscheduled results relative to those of the manual schedules, by norm."""
    found = []
    for worker in workers:
        path = os.path.join(scratch, worker.name)
        worker.ask("save " + path, "saved")
        found.append(list(operators.saved_arrays(path)))
    return max(operators.errors_of(a, b)[1] for a, b in zip(*found))


def measure(name, options, machine):
    ours, threads = os.path.join(options.programs, "bench_kernels_retrograde"), str(options.threads)

    def start(worker, *command, seconds=operators.RUN_SECONDS):
        print(f"\r{name}: {worker}".ljust(50), end="\r", file=sys.stderr, flush=True)
        return operators.Worker(worker, [*command], options.threads, seconds)

    with tempfile.TemporaryDirectory(dir=options.scratch) as scratch:
        workers = [start("retrograde", ours, name, "full", threads, "Retrograde"),
                   start("by_hand", ours, name, "full", threads)]
        if options.halide_worker:
            workers += [start(s, options.halide_worker, name, "full", threads, s,
                              seconds=operators.SEARCH_SECONDS) for s in SCHEDULES]
        try:
            operators.run_in_turn(workers, options.rounds)
            for worker in workers[:2]:
                if worker.failure:
                    sys.exit(f"{name}, {worker.name}: {worker.failure}")
            return figures(name, workers, machine, error_of(workers[:2], scratch))
        finally:
            for worker in workers:
                if not worker.failure:
                    worker.close()


def figures(name, workers, machine, error):
    done = {w.name: w.median() for w in workers if w.median() is not None}
    started = {w.name for w in workers}
    halide = {s: done.get(s) for s in SCHEDULES if s in started}
    best = min((s for s in halide if halide[s]), key=halide.get, default=None)
    compile_s, _, moved, operations, _, search_s = workers[0].ready
    return {"kernel": name, "retrograde_ms": done["retrograde"], "by_hand_ms": done["by_hand"],
            "halide_ms": halide, "halide_best": best, "halide_best_ms": halide.get(best),
            "compile_s": compile_s, "search_s": search_s, "norm_error": error,
            "bound_ms": 1e3 * max(moved / machine["bytes_per_second"], operations / machine["flops"]),
            "spread_ms": {w.name: operators.spread(w.times) for w in workers if w.times},
            "failures": {w.name: w.failure for w in workers if w.failure}}


def line(row):
    best = row["halide_best_ms"]
    return (f"{row['kernel']:24}{row['retrograde_ms']:9.2f}{row['by_hand_ms']:9.2f}"
            f"{best or float('nan'):9.2f} {row['halide_best'] or '-':14}"
            f"{row['retrograde_ms'] / row['by_hand_ms']:7.2f}"
            f"{row['retrograde_ms'] / best if best else float('nan'):7.2f}{row['norm_error']:10.1e}")


def read_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("programs")
    parser.add_argument("--kernel", action="append", choices=kernel_names(), dest="kernels")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--no-halide", action="store_true")
    parser.add_argument("--output", default="autoscheduled.json")
    options = parser.parse_args()
    options.scratch = os.path.dirname(os.path.abspath(options.output))
    options.halide_worker = None
    return options


def main():
    options = read_options()
    versions = {}
    if not options.no_halide:
        operators.make_peers(["halide"])
        versions = {"halide": operators.version("halide")}
        options.halide_worker = operators.build_halide_worker(
            "kernels", [f"kernels/{name}.cpp" for name in kernel_names()], "BENCH_FORWARD")
    machine = json.loads(subprocess.check_output(
        [os.path.join(options.programs, "bench_machine"), str(options.threads)]))
    report = {"machine": machine, "versions": versions, "kernels": []}
    print(f"{'ms':24}{'ours':>9}{'by hand':>9}{'Halide':>9} {'by':14}{'/hand':>7}{'/Halide':>7}{'error':>10}")
    for name in options.kernels or kernel_names():
        row = measure(name, options, machine)
        report["kernels"].append(row)
        operators.write(options.output, report)
        print(line(row), flush=True)
    for what, key in (("by hand", "by_hand_ms"), ("Halide's best", "halide_best_ms")):
        ratios = [r["retrograde_ms"] / r[key] for r in report["kernels"] if r[key]]
        if ratios:
            print(f"geometric mean of our time over that {what}: {statistics.geometric_mean(ratios):.3f}")
    print("report:", options.output)
    sys.exit(any(r["norm_error"] > MOST_ERROR for r in report["kernels"]))


if __name__ == "__main__":
    main()
