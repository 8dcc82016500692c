#!/usr/bin/env python3
"""Writes the results of a benchmark into its section of a page (tools/bench --record).

usage: measurements.py SECTION REPORT.json PAGE --commit COMMIT [--machine WORDS]

A section is between the lines "<!-- measured: SECTION -->" and "<!-- end of section -->"; the text around it
is written by hand. The section's first line names the machine and the commit.
"""
import argparse
import json
import math
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path += [HERE, os.path.join(HERE, "operators"), os.path.join(HERE, "plans")]
import decisions  # noqa: E402
import judge  # noqa: E402
import model  # noqa: E402


def geometric_mean(ratios):
    ratios = list(ratios)
    return math.exp(sum(math.log(r) for r in ratios) / len(ratios)) if ratios else float("nan")


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def ms(value):
    return f"{value:.2f} ms" if value >= 0.1 else f"{value:.4f} ms"


def pairs(report):
    """Kernels or gradients, compiled in process, compared with Halide 14's."""
    rows, done = [], [r for r in report if not r.get("failure")]
    for r in report:
        name = f"{r['kernel']} ({r['threads']})"
        if r.get("failure"):
            rows.append([name, "failed", "", "", "", "", ""])
            continue
        rows.append([name, ms(r["retrograde_ms"]), ms(r["halide_ms"]), f"{r['run_ratio']:.2f}",
                     f"{r['compile_ratio']:.2f}",
                     f"{r['retrograde_peak_mb']:.0f} / {r['halide_peak_mb']:.0f}",
                     f"{r['percent_of_bound']:.0f} %"])
    head = ["program (threads)", "Retrograde", "Halide 14", "run ratio", "compile ratio", "peak MB",
            "of bound"]
    return table(head, rows) + means(done)


def programs(report):
    """Programs compiled ahead of time, and gradients of such."""
    done = [p for p in report["programs"] if not p.get("failure")]
    rows = [[p["program"], f"{p['run_ratio']:.2f}",
             ", ".join(f"{c['retrograde_ms']:.3g} / {c['halide_ms']:.3g}" for c in p["cases"]),
             f"{p['compile_ratio']:.2f}"] for p in done]
    rows += [[p["program"], "failed", "", ""] for p in report["programs"] if p.get("failure")]
    head = ["program", "run ratio", "ms, Retrograde / Halide 14, by size", "compile ratio"]
    return table(head, rows) + means(done)


def means(rows):
    run, compiled = ([r[key] for r in rows] for key in ("run_ratio", "compile_ratio"))
    return (f"\nGeometric means of {len(rows)}: run time {geometric_mean(run):.2f} of Halide 14's, "
            f"compile time {geometric_mean(compiled):.2f}.\n")


def gradients(report):
    rows = [[p["program"], ms(p["primal_ms"]), ms(p["gradient_ms"]), f"{p['ratio']:.1f}"]
            for p in report["programs"]]
    return table(["program", "program", "gradient", "ratio"], rows)


def pytorch(report):
    rows = [[p["program"], ms(p["retrograde_ms"]), ms(p["pytorch_ms"]),
             ms(p["pytorch_compiled_ms"]) if p["pytorch_compiled_ms"] else "not in its time",
             f"{p['ratio']:.2f}"] for p in report["programs"]]
    head = ["gradient", "Retrograde", f"PyTorch {report['pytorch']}", "torch.compile",
            "ratio to the better"]
    return table(head, rows) + f"\nGeometric mean: {report['geometric_mean']:.2f}.\n"


def torch_operators(report):
    def cells(row, what):
        times = [row.get(f"{side}_{what}_ms") for side in ("retrograde", "eager", "compiled")]
        return [" / ".join("–" if t is None else f"{t:.3g}" for t in times),
                f"{row[f'{what}_ratio']:.2f}" if f"{what}_ratio" in row else "–"]

    rows = [[r["operator"], *cells(r, "forward"), *cells(r, "both"),
             " / ".join(f"{r[f'{side}_error']:.0e}" if f"{side}_error" in r else "–"
                        for side in ("retrograde", "eager", "compiled"))] for r in report["operators"]]
    head = [f"ms: ours / PyTorch {report['pytorch']} / torch.compile", "forward", "times as fast",
            "forward and backward", "times as fast", "error"]
    return table(head, rows) + (f"\nGeometric means to the better of PyTorch's two: forward "
                                f"{report['forward_geometric_mean']:.2f}, with backward "
                                f"{report['both_geometric_mean']:.2f} times as fast.\n"
                                ) + call_overhead(report.get("overhead_us"))


def outside(report):
    def times(row, what):
        return " / ".join(f"{row[key]:.3g}" if (key := f"{side}_{what}_ms") in row else "–"
                          for side in ("retrograde", "eager", "compiled"))

    rows = []
    for r in report["programs"]:
        name = r["program"] + (" *" if r["program"] in report["held_out"] else "")
        ratios = [f"{r[key]:.2f}" if (key := f"{what}_ratio") in r else "–" for what in ("forward", "both")]
        rows.append([name, times(r, "forward"), ratios[0], times(r, "both"), ratios[1],
                     f"{r['retrograde_error']:.0e}" if "retrograde_error" in r else "–",
                     f"{r['retrograde_first_s']:.1f} s" if "retrograde_first_s" in r else "–",
                     "failed" if r["failure"] else ""])
    head = [f"ms: ours / PyTorch {report['pytorch']} / torch.compile", "forward", "times as fast",
            "forward and backward", "times as fast", "error", "compiled in", ""]
    means = [[group.replace("_", " "), str(m["programs"]), str(m["failures"]),
              *(f"{m[what]:.2f} ({m[f'{what}_below_1']} below 1, {m[f'{what}_below_0.7']} below 0.7)" if what in m else "–"
                for what in ("forward", "both"))] for group, m in report["means"].items()]
    return (table(head, rows) + "\n\\* held out: the compiler is not tuned on it.\n\n"
            + table(["programs", "count", "failed", "forward, geometric mean", "forward and backward"], means))


def call_overhead(report):
    if not report:
        return ""
    ways = list(report["PyTorch"])
    rows = [[name, *(f"{row[way]:.1f}" + ("" if name == "PyTorch" else f" ({row[way] - report['PyTorch'][way]:+.1f})")
                     for way in ways)] for name, row in report.items()]
    return "\n" + table(["us for a call on one element (over PyTorch's own)", *ways], rows)


def operators(report):
    def cell(value):
        return "–" if value is None else f"{value:.3g}"

    def beside(r):
        return [r["halide_best_ms"], r["pytorch_ms"], r["pytorch_compiled_ms"]]

    rows, ratios = [], []
    for r in report["operators"]:
        if r["retrograde_ms"] is None:
            rows.append([r["operator"], "failed", *[""] * 8])
            continue
        peers = [ms for ms in beside(r) if ms]
        if peers:
            ratios.append(r["retrograde_ms"] / min(peers))
        megabytes = (r["peak_mb"], r["halide_best_peak_mb"], r["pytorch_peak_mb"])
        rows.append([r["operator"], cell(r["retrograde_ms"]), *map(cell, beside(r)),
                     r["halide_best"] or "–", cell(r["bound_ms"]),
                     " / ".join("–" if mb is None else f"{mb:.0f}" for mb in megabytes),
                     f"{r['compile_s'] + r['search_s']:.2f} s",
                     "–" if r["max_relative_error"] is None else f"{r['max_relative_error']:.0e}"])
    machine, versions = report["machine"], report["versions"]
    head = ["operator, ms", "Retrograde", f"Halide {versions.get('halide', '')}",
            f"PyTorch {versions.get('pytorch', '')}", "torch.compile", "best of Halide's", "bound",
            "peak MB, Retrograde / Halide / PyTorch", "compiled in", "error"]
    return (f"{machine['threads']} threads, {machine['bytes_per_second'] / 1e9:.1f} GB/s, "
            f"{machine['flops'] / 1e9:.0f} GFLOP/s.\n\n" + table(head, rows) +
            f"\nGeometric mean of our time over that of the best other: {geometric_mean(ratios):.2f}.\n")


def autoscheduled(report):
    def cell(value):
        return "failed" if value is None else f"{value:.3g}"

    rows, by_hand, halide = [], [], []
    for r in report["kernels"]:
        rows.append([r["kernel"], cell(r["retrograde_ms"]), cell(r["by_hand_ms"]),
                     *(cell(t) for t in r["halide_ms"].values()), cell(r["bound_ms"])])
        by_hand.append(r["retrograde_ms"] / r["by_hand_ms"])
        if r["halide_best_ms"]:
            halide.append(r["retrograde_ms"] / r["halide_best_ms"])
    head = ["kernel, ms", "Retrograde's autoscheduler", "Retrograde by hand",
            *(f"Halide {report['versions'].get('halide', '')}, {s}" for s in report["kernels"][0]["halide_ms"]),
            "bound"]
    beside = f", over that of Halide's best {geometric_mean(halide):.2f}" if halide else ""
    return (table(head, rows) + f"\nGeometric mean of our time over that by hand: "
            f"{geometric_mean(by_hand):.2f}{beside}.\n")


def demo(report):
    halide = report["halide_ms_per_step"]
    rows = [["one training step", ms(report["ms_per_step"])],
            ["the same with Halide 14, scheduled by Li2018",
             "not measured" if halide is None else f"{ms(halide)}, {halide / report['ms_per_step']:.1f} times"],
            ["likeness", f"{report['psnr_initial_db']:.1f} to {report['psnr_final_db']:.1f} dB in "
                         f"{report['steps']} steps, {report['seconds']:.1f} s"],
            ["gradients from differences in double",
             f"{report['gradient_check_max_relative_error']:.1e} at most"],
            ["memory", f"{report['peak_memory_mb']:.0f} MB"]]
    return table(["what", "figure"], rows)


def compile_time(report):
    """Google Benchmark's JSON: names end in the number of stages."""
    rows = [[b["name"], f"{b['real_time']:.3g} {b['time_unit']}"] for b in report["benchmarks"]
            if b.get("run_type") != "aggregate"]
    return table(["chain of stencils", "time"], rows)


SECTIONS = {"demo": demo, "kernels": pairs, "gradient_peers": pairs, "programs": programs,
            "programs_second": programs, "programs_gradients": programs, "gradients": gradients,
            "pytorch_peers": pytorch, "torch": torch_operators, "outside": outside, "operators": operators, "autoscheduled": autoscheduled,
            "compile_time": compile_time, "model": model.table, "plans": judge.table,
            "decisions": lambda report: decisions.table(report) + "\n"}


def this_machine():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        info = file.read()
    name = re.search(r"model name\s*: (.*)", info)
    wide = next((words for flag, words in (("avx512f", ", AVX-512"), ("avx2", ", AVX2"))
                 if re.search(rf"\b{flag}\b", info)), "")
    return f"{os.cpu_count()} cores of {name.group(1) if name else 'a processor'}{wide}"


def record(page, section, body):
    opening, closing = f"<!-- measured: {section} -->\n", "<!-- end of section -->\n"
    start = page.find(opening)
    end = page.find(closing, start)
    if start < 0 or end < 0:
        sys.exit(f'cannot record "{section}": the page must have the line "{opening.strip()}" and, after '
                 f'it, "{closing.strip()}"; one is missing. Add them where the figures shall stand.')
    return page[:start + len(opening)] + body + page[end:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("section", choices=SECTIONS)
    parser.add_argument("report")
    parser.add_argument("page")
    parser.add_argument("--commit", required=True)
    parser.add_argument("--machine", default=this_machine())
    options = parser.parse_args()
    with open(options.report, encoding="utf-8") as file:
        report = json.load(file)
    with open(options.page, encoding="utf-8") as file:
        page = file.read()
    body = (f"Measured on {options.machine}, at commit {options.commit}.\n\n" +
            SECTIONS[options.section](report))
    page = record(page, options.section, body)
    with open(options.page, "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
