#!/usr/bin/env python3
"""model.py -- compares the cost model's prediction of every stage with its measured time.

The stages are those of the operators and of the autoscheduled kernels. The report also says how well predictions
order the measurements.

    model.py PROGRAMS [--program NAME]... [--threads N] [--seconds S] [--output FILE] [--plot FILE]

PROGRAMS is the folder of bench_operators_retrograde and bench_kernels_retrograde. The parameters of the machine are
those that RETROGRADE_MACHINE names or that were measured before (`tune --machine`); they never depend on
a program. Stages that take less than 5 us are left out, because the profiler samples every millisecond.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
LEAST_MS = 0.005


def names_in(path, word):
    with open(os.path.join(HERE, path), encoding="utf-8") as file:
        return re.findall(rf"^{word}\((\w+)\)", file.read(), re.M)


def programs():
    """(kind, name): one name may be an operator and a kernel."""
    return ([("operators", n) for n in names_in("operators/list.def", "OPERATOR")]
            + [("kernels", n) for n in names_in("list.def", "KERNEL")])


def explain(options, kind, name):
    """The report of one program, or the reason for which it has none."""
    worker = os.path.join(options.programs, f"bench_{kind}_retrograde")
    command = [worker, name, "full", str(options.threads)]
    if kind == "kernels":
        command.append("Retrograde")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.json")
        try:
            done = subprocess.run(command, input=f"explain {path} {options.seconds}\n", text=True,
                                  capture_output=True, timeout=120, check=False)
        except subprocess.TimeoutExpired:
            return None, "it took more than 120 s"
        if not os.path.exists(path):
            return None, (done.stdout + done.stderr).strip().split("\n")[-1]
        with open(path, encoding="utf-8") as file:
            return json.load(file), None


def ranks(values):
    """Ranks from 1; equal values share the mean of their ranks."""
    order = sorted(range(len(values)), key=values.__getitem__)
    result = [0.0] * len(values)
    begin = 0
    while begin < len(order):
        end = begin
        while end < len(order) and values[order[end]] == values[order[begin]]:
            end += 1
        for i in order[begin:end]:
            result[i] = (begin + end + 1) / 2
        begin = end
    return result


def spearman(pairs):
    """The rank correlation of (predicted, measured); None if there are fewer than two pairs."""
    if len(pairs) < 2:
        return None
    a, b = ranks([p for p, _ in pairs]), ranks([m for _, m in pairs])
    mean = (len(pairs) + 1) / 2
    cross = sum((x - mean) * (y - mean) for x, y in zip(a, b))
    square = [sum((x - mean) ** 2 for x in r) for r in (a, b)]
    return cross / (square[0] * square[1]) ** 0.5 if min(square) > 0 else None


def pairs_of(report):
    return [(s["predicted_ms"], s["measured_ms"]) for s in report["stages"]
            if s["name"] and s["measured_ms"] and s["measured_ms"] >= LEAST_MS]


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(figsize=(7, 6.5), dpi=90)
    for kind, marker, color in (("operators", "o", "C0"), ("kernels", "s", "C1")):
        points = [p for row in rows if row["kind"] == kind for p in row["pairs"]]
        if points:
            axes.loglog(*zip(*points), marker, color=color, alpha=0.6, markersize=5, label=f"stages of {kind}")
    ends = [1e-3, 1e3]
    axes.plot(ends, ends, color="gray", lw=0.8)
    for factor in (0.5, 2):
        axes.plot(ends, [factor * e for e in ends], color="gray", lw=0.5, ls=":")
    axes.set_xlabel("predicted [ms]")
    axes.set_ylabel("measured [ms]")
    axes.set_xlim(1e-3, 300)
    axes.set_ylim(LEAST_MS / 2, 300)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, metadata={"Software": None} if path.endswith(".png") else None)


def number(value):
    return "-" if value is None else f"{value:.2f}"


HEAD = "| program | stages | rank correlation | predicted ms | measured ms |\n|---|---|---|---|---|"


def line(row):
    return (f"| {row['program']} ({row['kind'][:-1]}) | {len(row['pairs'])} | {number(row['rank_correlation'])} | "
            f"{row['predicted_ms']:.2f} | {row['measured_ms']:.2f} |")


def last_line(rows):
    every = [p for row in rows for p in row["pairs"]]
    totals = [(row["predicted_ms"], row["measured_ms"]) for row in rows]
    return f"| all | {len(every)} | {number(spearman(every))} | of totals | {number(spearman(totals))} |"


def table(report):
    return "\n".join([HEAD, *map(line, report["programs"]), last_line(report["programs"])]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("programs")
    parser.add_argument("--program", action="append")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--output", default="model.json")
    parser.add_argument("--plot")
    options = parser.parse_args()
    rows = []
    print(HEAD)
    for kind, name in programs():
        if options.program and name not in options.program:
            continue
        report, failure = explain(options, kind, name)
        if failure:
            print(f"| {name} ({kind}) | failed: {failure} | | | |", flush=True)
            continue
        pairs = pairs_of(report)
        row = {"program": name, "kind": kind, "pairs": pairs, "rank_correlation": spearman(pairs), **report}
        rows.append(row)
        print(line(row), flush=True)
        with open(options.output, "w", encoding="utf-8") as file:
            json.dump({"programs": rows}, file, indent=1)
    print(last_line(rows))
    if options.plot and rows:
        draw(rows, options.plot)
    sys.exit(0 if rows else 1)


if __name__ == "__main__":
    main()
