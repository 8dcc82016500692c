#!/usr/bin/env python3
"""judge.py -- how well cost models order plans and stages, from a report of plans.py.

    judge.py REPORT.json [--commit COMMIT] [--wrong] [--plot FILE]

A plan ran in turn with the default plan of its program. Its time is the ratio of the two, times the least time of the
default plan, so that other load on the machine matters less. A program's noise is what two other copies of the default
plan differ from it, one measured first and one last; at least LEAST_NOISE. Figures of a model:

- tau: Kendall's tau-b over pairs of stages of the default plan whose measured times differ by more than the noise;
- rho: Spearman's rank correlation over the plans of a program, if there are FEWEST_PLANS and these differ by more than
  twice the noise;
- regret: measured time of the plan that the model prices least, over that of the fastest plan;
- predicted / measured: times of the default plan, or of all plans.

--wrong lists pairs of plans whose times differ by more than WRONG_FACTOR and that a model orders wrongly.
"""
import argparse
import json
import math
import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from model import spearman  # noqa: E402

LEAST_NOISE = 0.02
MOST_SLOWDOWN = 1.08  # of the default plan beside which another one was measured; of others, the measurement is dropped
FEWEST_PLANS = 4  # for a correlation over the plans of a program
FEWEST_SAMPLES = 20  # of the profiler, for a stage to count
SAMPLE_SECONDS = 1e-3
RIGHT_FACTOR = 1.5
WRONG_FACTOR = 1.3
SLOWER = 1.05  # without a move: more than noise


# ---- statistics ----

def kendall_tau_b(pairs, differ):
    """Kendall's tau-b of (predicted, measured), over pairs of entries for which differ(i, j) holds. Equal predictions
    count as ties; None if no pair differs or all predictions are equal."""
    concordant = discordant = ties = 0
    for i, (a, b) in enumerate(pairs):
        for j in range(i):
            c, d = pairs[j]
            if not differ(i, j):
                continue
            order = (a > c) - (a < c)
            ties += order == 0
            concordant += order * (b - d) > 0
            discordant += order * (b - d) < 0
    every = concordant + discordant + ties
    if every == ties:
        return None
    return (concordant - discordant) / math.sqrt(every * (every - ties))


def regret(pairs):
    """Measured time of the entry that is predicted fastest, over the least measured time. As in a search, the first of
    equal predictions counts."""
    picked = min(range(len(pairs)), key=lambda i: pairs[i][0])
    return pairs[picked][1] / min(measured for _, measured in pairs)


def share_within(ratios, factor):
    return sum(1 / factor <= r <= factor for r in ratios) / len(ratios) if ratios else None


# ---- programs ----

def measured_plans(program):
    """The plans that ran undisturbed, with "time" beside the raw figures; the default plan is the first."""
    plans = [plan for plan in program["plans"] if "seconds" in plan]
    least = min((plan["default_seconds"] for plan in plans), default=0)
    return [{**plan, "time": plan["seconds"] / plan["default_seconds"] * least} for i, plan in enumerate(plans)
            if i == 0 or plan["default_seconds"] <= MOST_SLOWDOWN * least]


def noise_of(program):
    copies = [plan for plan in (*program["plans"][:1], program.get("again", {})) if "seconds" in plan]
    return max([LEAST_NOISE, *(abs(plan["seconds"] / plan["default_seconds"] - 1) for plan in copies)])


def stage_pairs(program, model):
    """(predicted, measured, relative error of the measurement) of the default plan's stages. Stages that share their
    loops count as one."""
    plan = next((plan for plan in program["plans"] if plan.get("stages")), None)
    if not plan or model not in plan["prices"]:
        return []
    shared = plan.get("shared", {})
    totals = {}  # by Func: predicted, measured
    for which, times in enumerate((plan["prices"][model]["stages"], plan["stages"])):
        for name, seconds in times.items():
            totals.setdefault(shared.get(name, name), [0.0, 0.0])[which] += seconds
    result, noise = [], noise_of(program)
    for predicted, measured in totals.values():
        samples = measured / plan["stages_seconds"] * plan["sampled_seconds"] / SAMPLE_SECONDS
        if samples >= FEWEST_SAMPLES and predicted > 0:
            result.append((predicted, measured, max(noise, samples ** -0.5)))
    return result


def stages_tau(stages):
    def differ(i, j):
        (_, a, error_a), (_, b, error_b) = stages[i], stages[j]
        return abs(a - b) > math.hypot(a * error_a, b * error_b)

    return kendall_tau_b([(p, m) for p, m, _ in stages], differ)


def plan_pairs(program, model):
    """(predicted, measured) of the plans that ran."""
    return [(plan["prices"][model]["seconds"], plan["time"]) for plan in measured_plans(program)
            if model in plan["prices"]]


def plans_rho(pairs, noise):
    times = [measured for _, measured in pairs]
    differ = len(pairs) >= FEWEST_PLANS and max(times) > min(times) * (1 + 2 * noise)
    return spearman(pairs) if differ else None


def judge_program(program, model):
    pairs, stages = plan_pairs(program, model), stage_pairs(program, model)
    if not pairs:
        return None
    first = next(plan for plan in measured_plans(program) if model in plan["prices"])
    prices = [plan["prices"][model]["price_seconds"] for plan in measured_plans(program) if model in plan["prices"]]
    peak = first["prices"][model].get("peak_bytes")
    return {"plans": len(pairs), "tau": stages_tau(stages), "rho": plans_rho(pairs, noise_of(program)),
            "regret": regret(pairs), "ratio": pairs[0][0] / pairs[0][1], "price_seconds": statistics.median(prices),
            "peak_ratio": peak / first["peak_bytes"] if peak and first.get("peak_bytes") else None,
            "pairs": pairs, "stages": [(p, m) for p, m, _ in stages]}


def models_of(run):
    return sorted({model for program in run["programs"].values() for plan in program["plans"]
                   for model in plan.get("prices", {})})


def judge(run):
    """By model and program."""
    result = {}
    for model in models_of(run):
        judged = {name: judge_program(program, model) for name, program in run["programs"].items()}
        result[model] = {name: figures for name, figures in judged.items() if figures}
    return result


def summary(judged):
    """Over all programs, the figures of a model."""
    def known(key):
        return [figures[key] for figures in judged.values() if figures[key] is not None]

    ratios = [p / m for figures in judged.values() for p, m in figures["pairs"]]
    every_stage = [pair for figures in judged.values() for pair in figures["stages"]]
    mean = lambda values: statistics.fmean(values) if values else None  # noqa: E731
    return {"programs": len(judged), "plans": len(ratios),
            "tau, mean": mean(known("tau")), "tau, worst": min(known("tau"), default=None),
            "rho over plans, mean": mean(known("rho")), "rho over plans, worst": min(known("rho"), default=None),
            "regret, mean": mean(known("regret")), "regret, worst": max(known("regret"), default=None),
            f"plans within a factor of {RIGHT_FACTOR}": share_within(ratios, RIGHT_FACTOR),
            "predicted / measured, median": statistics.median(ratios) if ratios else None,
            "rho over all stages": spearman(every_stage),
            "peak memory, predicted / measured, median": statistics.median(known("peak_ratio") or [math.nan]),
            "ms for a price, median": 1e3 * statistics.median(known("price_seconds"))}


def times_of_sources(run, prefix):
    """By the rest of a plan's source after the prefix: [(program, time over that of the default plan)]."""
    result = {}
    for name, program in run["programs"].items():
        plans = measured_plans(program)
        for plan in plans:
            for source in plan["source"].split(", "):
                if source.startswith(prefix):
                    result.setdefault(source[len(prefix):], []).append((name, plan["time"] / plans[0]["time"]))
    return result


def searched_text(run):
    lines = []
    for width, found in sorted(times_of_sources(run, "beam ").items(), key=lambda item: int(item[0])):
        times = [time for _, time in found]
        worst = max(found, key=lambda pair: pair[1])
        lines.append(f"Time of the plans that a search over moves of width {width} takes, over that of the default "
                     f"plans: geometric mean {statistics.geometric_mean(times):.2f} ({len(times)} programs), "
                     f"at worst {worst[1]:.2f} ({worst[0]}).\n\n")
    return "".join(lines)


def ablation(run):
    """By move: [(program, time of the plan found without the move over that of the plan found with all of them)]."""
    with_all = dict(times_of_sources(run, "beam ").get("1", []))
    return {move: [(name, time / with_all[name]) for name, time in found if name in with_all]
            for move, found in times_of_sources(run, "no ").items()}


def ablation_text(run):
    rows = []
    for move, found in sorted(ablation(run).items()):
        times = [time for _, time in found]
        worst, most = max(found, key=lambda pair: pair[1])
        rows.append([f"`{move}`", str(sum(time > SLOWER for time in times)), f"{statistics.geometric_mean(times):.2f}",
                     f"{most:.2f} ({worst})" if most > SLOWER else "–"])
    head = ["without the move", f"slower by more than {100 * (SLOWER - 1):.0f} %", "time, geometric mean", "slowest"]
    return markdown(head, rows) + "\n" if rows else ""


def wrong_pairs(program, model):
    """(fast plan, slow plan, measured factor, predicted factor) for pairs that the model orders wrongly, the worst
    first. Equal prices are not wrong."""
    plans = [plan for plan in measured_plans(program) if model in plan["prices"]]
    result = []
    for fast in plans:
        for slow in plans:
            measured = slow["time"] / fast["time"]
            predicted = slow["prices"][model]["seconds"] / fast["prices"][model]["seconds"]
            if measured > WRONG_FACTOR and predicted < 1:
                result.append((fast, slow, measured, predicted))
    return sorted(result, key=lambda pair: pair[3] / pair[2])


# ---- reports ----

def number(value):
    if isinstance(value, int):
        return str(value)
    return "–" if value is None or math.isnan(value) else f"{value:.2f}"


def markdown(head, rows):
    return "".join("| " + " | ".join(cells) + " |\n" for cells in [head, ["---"] * len(head), *rows])


def table(report, commit=None):
    """The last run of a report, or that of a commit, as Markdown."""
    run = run_of(report, commit)
    judged = judge(run)
    models = list(judged)
    summaries = [summary(judged[model]) for model in models]
    rows = [[key, *(number(s[key]) for s in summaries)] for key in summaries[0]] if models else []
    text = markdown(["over all programs", *models], rows) + "\n" + searched_text(run) + ablation_text(run)
    figures = ("tau", "rho", "regret", "ratio")
    names = {"tau": "tau", "rho": "rho", "regret": "regret", "ratio": "predicted / measured"}
    rows = []
    for name, program in run["programs"].items():
        plans = measured_plans(program)
        if not plans:
            rows.append([name, "failed", *[""] * (3 + len(models) * len(figures))])
            continue
        fastest = min(plan["time"] for plan in plans)
        rows.append([name, str(len(plans)), f"{1e3 * plans[0]['time']:.3g}", f"{1e3 * fastest:.3g}",
                     f"{100 * noise_of(program):.0f} %"]
                    + [number(judged[model].get(name, {}).get(key)) for model in models for key in figures])
    head = ["program", "plans", "default, ms", "fastest, ms", "noise"]
    return text + markdown(head + [f"{names[key]}, {model}" for model in models for key in figures], rows)


def wrong_table(run):
    rows = []
    for name, program in run["programs"].items():
        for model in models_of(run):
            for fast, slow, measured, predicted in wrong_pairs(program, model)[:1]:
                rows.append([name, model, fast["key"], slow["key"], f"{1e3 * fast['time']:.3g}",
                             f"{1e3 * slow['time']:.3g}", number(measured), number(predicted)])
    head = ["program", "model", "fast plan", "slow plan", "ms", "ms", "measured factor", "predicted factor"]
    return markdown(head, rows)


def run_of(report, commit=None):
    runs = [run for run in report["runs"] if commit in (None, run["commit"])]
    if not runs:
        sys.exit(f"the report has no run of commit {commit}, only of: "
                 + ", ".join(run["commit"] for run in report["runs"]))
    return runs[-1]


def draw(run, path):
    """Predicted over measured times: all plans, a panel for each model."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    judged = judge(run)
    figure, axes = plt.subplots(1, len(judged), figsize=(6.5 * len(judged), 6), dpi=90, squeeze=False)
    for axis, (model, programs) in zip(axes[0], judged.items()):
        for name, figures in programs.items():
            predicted, measured = zip(*figures["pairs"])
            axis.loglog([1e3 * p for p in predicted], [1e3 * m for m in measured], ".", alpha=0.6, markersize=5)
        ends = [1e-2, 1e3]
        for factor in (1 / RIGHT_FACTOR, 1, RIGHT_FACTOR):
            axis.plot(ends, [factor * e for e in ends], color="gray", lw=0.8 if factor == 1 else 0.5,
                      ls="-" if factor == 1 else ":")
        axis.set_title(f"{model}: plans of {len(programs)} programs")
        axis.set_xlabel("predicted [ms]")
        axis.set_ylabel("measured [ms]")
        axis.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, metadata={"Software": None} if path.endswith(".png") else None)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("report")
    parser.add_argument("--commit")
    parser.add_argument("--wrong", action="store_true")
    parser.add_argument("--plot")
    options = parser.parse_args()
    with open(options.report, encoding="utf-8") as file:
        report = json.load(file)
    print(table(report, options.commit), end="")
    if options.wrong:
        print("\n" + wrong_table(run_of(report, options.commit)), end="")
    if options.plot:
        draw(run_of(report, options.commit), options.plot)


if __name__ == "__main__":
    main()
