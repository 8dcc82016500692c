#!/usr/bin/env python3
"""decisions.py -- ablation of our autoscheduler: times of each operator with all decisions, and without each one.

    decisions.py PROGRAMS [--operator NAME]... [--rounds N] [--threads N] --output FILE

PROGRAMS is the folder of bench_operators_retrograde. Each setting of an operator has its own worker; workers run in
turn, with pauses: see operators.py. The table is Markdown on standard output; FILE receives the times of all runs.
"""
import argparse
import os
import sys

import operators

DECISIONS = ["scatter_strategy", "cut_reductions", "register_tiles", "layout_staging", "join_sweeps", "slices",
             "task_sizes", "strips", "choices"]


def measure(name, options):
    """Times in milliseconds by the decision that is left out; None for failures."""
    program = os.path.join(options.programs, "bench_operators_retrograde")
    settings = {"": "", **{each: "without=" + each for each in DECISIONS}, "all": "without=" + "+".join(DECISIONS)}
    workers = {key: operators.Worker(key, [program, name, "full", str(options.threads), setting], options.threads, 120)
               for key, setting in settings.items()}
    try:
        operators.run_in_turn(list(workers.values()), options.rounds)
    finally:
        for worker in workers.values():
            if not worker.failure:
                worker.close()
    for key, worker in workers.items():
        if worker.failure:
            print(f"{name} without {key}: {worker.failure}", file=sys.stderr)
    return {key: worker.times if worker.median() else None for key, worker in workers.items()}


def median(times):
    return sorted(times)[len(times) // 2] if times else None


def table(results):
    names = list(results)
    lines = ["| ms | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
    for key in ["", *DECISIONS, "all"]:
        what = {"": "with every decision", "all": "without all of them"}.get(key, f"without `{key}`")
        cells = []
        for name in names:
            time, whole = median(results[name][key]), median(results[name][""])
            cells.append("failed" if not time or not whole else
                         f"{time:.1f}" + (f" (×{time / whole:.2f})" if key and abs(time / whole - 1) > 0.05 else ""))
        lines.append(f"| {what} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("programs")
    parser.add_argument("--operator", action="append", default=[])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--output", required=True)
    options = parser.parse_args()
    results = {name: measure(name, options) for name in options.operator or operators.operator_names()}
    operators.write(options.output, results)
    print(table(results))


if __name__ == "__main__":
    main()
