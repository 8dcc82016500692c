#!/usr/bin/env python3
"""plans.py -- measures plans of the benchmarks' programs and judges cost models by them.

    plans.py BUILD [--long] [--program PATTERN]... [--decisions N] [--walks N] [--seed N] [--widths N,...]
             [--ablation] [--seconds S] [--stage-seconds S] [--repeats N] [--limit S] [--minutes M] [--collect] [--output FILE]
             [--plot FILE] [--wrong]
    plans.py BUILD --pair PROGRAM FAST_KEY SLOW_KEY FILE.pair [--output FILE]

BUILD is the folder of a build. The programs are those of programs.py, which runs first if it has not run before, or
with --collect. PATTERN is a shell pattern of names, such as 'operators-*'. Each program has a process of its own. A
plan that ends it, or takes more than --limit seconds, counts as failed. No program begins after --minutes.

--pair writes two plans of the last run to a file, with their times and the models that order them wrongly.

FILE is JSON with a run for each commit and each setting. A run that was interrupted goes on where it stopped. judge.py
prints it.
"""
import argparse
import fnmatch
import glob
import json
import math
import os
import select
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, HERE)
import judge  # noqa: E402
import programs  # noqa: E402

# A few minutes: one program of each kind of work.
SHORT = ["operators-conv2d", "operators-spatial_transformer", "operators-separable_block", "operators-flow_warp",
         "operators-laplacian_loss", "pairs-warp", "pairs-normalisation", "kernels-bilateral_grid", "kernels-resize",
         "programs-matrix_product", "programs-unsharp", "outside-tridiagonal_rows", "outside-mutual_information"]


def git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()


def commit():
    """The commit of the working tree; "+" if it has changes outside of docs/."""
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + ("+" if changed else "")


def chosen_programs(folder, options):
    """The names of the programs in the order of the patterns."""
    names = sorted(os.path.basename(path).removesuffix(".graph") for path in glob.glob(os.path.join(folder, "*.graph")))
    patterns = options.program or (["*"] if options.long else SHORT)
    return list(dict.fromkeys(name for pattern in patterns for name in fnmatch.filter(names, pattern)))


class Worker:
    """The process that measures one program, read line by line with a limit for each."""

    def __init__(self, command, limit):
        self.limit = limit
        self.errors = tempfile.TemporaryFile()
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.errors)
        self.rest = b""

    def lines(self):
        """Yields objects until the process ends; raises TimeoutError when the next one takes too long."""
        while True:
            deadline = time.monotonic() + self.limit
            while b"\n" not in self.rest:
                ready, _, _ = select.select([self.process.stdout], [], [], max(0, deadline - time.monotonic()))
                if not ready:
                    raise TimeoutError(f"took more than {self.limit} s")
                more = os.read(self.process.stdout.fileno(), 1 << 16)
                if not more:
                    return
                self.rest += more
            line, self.rest = self.rest.split(b"\n", 1)
            yield json.loads(line)

    def end(self):
        """Why the process ended; empty if it finished its work."""
        if self.process.poll() is None:
            self.process.kill()
        status = self.process.wait()
        self.errors.seek(0)
        message = self.errors.read().decode(errors="replace").strip().split("\n")[-1]
        self.errors.close()
        self.process.stdout.close()
        return message or (f"its process ended with {status}" if status else "")


def keep_row(plans, row):
    """Adds the row of a plan. A second measurement of a plan replaces the first one if that was disturbed more."""
    for i, known in enumerate(plans):
        if known["key"] == row["key"]:
            if row.get("default_seconds", math.inf) < known.get("default_seconds", math.inf):
                plans[i] = {**known, **row}
            return
    plans.append(row)


def measure_once(command, program, limit):
    """Adds the rows of one process. Returns whether it ended before its work was done."""
    worker, started, why = Worker(command, limit), None, None
    try:
        for line in worker.lines():
            if "starts" in line:
                started = line["starts"]
            elif "key" in line:
                keep_row(program["plans"], line)
                started = None
            else:
                program.update(line)
    except TimeoutError as problem:
        why = str(problem)
    ended = worker.end()
    if "again" in program:
        return False
    why = why or ended or "its process ended"
    if started:
        keep_row(program["plans"], {"key": started, "error": why})
    else:
        program["error"] = why
    return started is not None


SAMPLE = ("decisions", "walks", "seed", "widths", "ablation")


def sample_options(settings):
    """The options of a worker on which its plans depend."""
    given = {key: value for key in SAMPLE if (value := settings.get(key)) is not False and value is not None}
    return [word for key, value in given.items() for word in ([f"--{key}"] if value is True else [f"--{key}", str(value)])]


def measure(name, folder, options):
    """The figures of a program; a plan that ends the process is skipped by the next one."""
    program = {"plans": []}
    command = [os.path.join(options.build, "bench", "bench_plans"), os.path.join(folder, name + ".graph"),
               *sample_options(vars(options)), "--seconds", str(options.seconds),
               "--stage-seconds", str(options.stage_seconds), "--repeats", str(options.repeats)]
    while measure_once([*command, "--skip", ",".join(["none", *(p["key"] for p in program["plans"])])], program,
                       options.limit):
        if "seconds" not in program["plans"][0]:
            break  # the default plan itself cannot run
    return program


def load(path):
    if not os.path.exists(path):
        return {"runs": []}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def write(report, path):
    temporary = path + ".tmp"
    with open(temporary, "w", encoding="utf-8") as file:
        json.dump(report, file, indent=1)
    os.replace(temporary, path)


def find_run(report, options):
    """The run of this commit with these settings, at the end of the report; a new one if there is none."""
    settings = {key: getattr(options, key) for key in (*SAMPLE, "seconds", "stage_seconds")}
    for run in report["runs"]:
        if run["commit"] == options.commit and run["settings"] == settings:
            report["runs"].remove(run)
            break
    else:
        run = {"commit": options.commit, "settings": settings, "programs": {}}
    report["runs"].append(run)
    return run


def write_pair(run, words, options):
    """Writes two plans of a run as a text of pair_file.h."""
    name, fast, slow, path = words
    plans = {plan["key"]: plan for plan in judge.measured_plans(run["programs"].get(name, {"plans": []}))}
    missing = [key for key in (fast, slow) if key not in plans]
    if missing:
        sys.exit(f"cannot write a pair of {name}: the last run has no undisturbed measurement of {', '.join(missing)}")
    wrong = [model for model, price in plans[fast]["prices"].items()
             if price["seconds"] >= plans[slow]["prices"][model]["seconds"]]
    command = [os.path.join(options.build, "bench", "bench_plans"), os.path.join(options.graphs, name + ".graph"),
               *sample_options(run["settings"]), "--pair", fast, slow, "--fast", str(plans[fast]["time"]),
               "--slow", str(plans[slow]["time"]), *(["--wrong", ",".join(wrong)] if wrong else [])]
    text = subprocess.run(command, capture_output=True, text=True, check=False)
    if text.returncode:
        sys.exit(text.stderr)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.stdout)


def line_of(name, program, seconds):
    plans = judge.measured_plans(program)
    if not plans:
        return f"{name:36} failed: {program.get('error') or program['plans'][0]['error']}"
    default, times = plans[0]["time"], [plan["time"] for plan in plans]
    text = (f"{name:36}{len(plans):4} plans, default {1e3 * default:8.3f} ms, fastest "
            f"{min(times) / default:.2f}, slowest {max(times) / default:.2f}")
    for model in sorted({m for p in plans for m in p["prices"]}):
        figures = judge.judge_program(program, model)
        text += f"; {model}: regret {figures['regret']:.2f}, ratio {figures['ratio']:.2f}"
    failed = sum("error" in plan for plan in program["plans"])
    disturbed = len(program["plans"]) - len(plans) - failed
    for count, what in ((failed, "failed"), (disturbed, "disturbed")):
        text += f"; {count} {what}" if count else ""
    return text + f" ({seconds:.0f} s)"


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--long", action="store_true", help="all programs and more plans")
    parser.add_argument("--program", action="append")
    parser.add_argument("--decisions", type=int, help="default plans without one or two decisions")
    parser.add_argument("--walks", type=int, help="plans of random moves")
    parser.add_argument("--widths", default="1,4", help="of searches over moves, a plan each")
    parser.add_argument("--ablation", action="store_true", help="plans of searches without one of the moves")
    parser.add_argument("--seed", type=int, default=1, help="of the moves")
    parser.add_argument("--seconds", type=float, default=0.2)
    parser.add_argument("--stage-seconds", type=float)
    parser.add_argument("--limit", type=float, default=60, help="seconds for a plan")
    parser.add_argument("--repeats", type=int, default=2, help="of measurements that other load disturbed")
    parser.add_argument("--minutes", type=float, default=math.inf, help="no program begins later")
    parser.add_argument("--collect", action="store_true")
    parser.add_argument("--graphs", default="out/bench/graphs", help="the folder of the programs")
    parser.add_argument("--output", default="out/bench/plans.json")
    parser.add_argument("--plot")
    parser.add_argument("--wrong", action="store_true", help="list plans that a model orders wrongly")
    parser.add_argument("--pair", nargs=4, metavar=("PROGRAM", "FAST_KEY", "SLOW_KEY", "FILE"))
    options = parser.parse_args()
    if options.decisions is None:
        options.decisions = 24 if options.long else 8
    if options.walks is None:
        options.walks = 40 if options.long else 8
    if options.stage_seconds is None:
        options.stage_seconds = 5 if options.long else 1
    options.commit = commit()
    return options


def main():
    options = read_options()
    if options.pair:
        write_pair(load(options.output)["runs"][-1], options.pair, options)
        return
    if options.collect or not glob.glob(os.path.join(options.graphs, "*.graph")):
        programs.collect(options.build, options.graphs, programs.GROUPS)
    report = load(options.output)
    run, started = find_run(report, options), time.monotonic()
    for name in chosen_programs(options.graphs, options):
        if name in run["programs"] or time.monotonic() > started + 60 * options.minutes:
            continue
        begin = time.monotonic()
        run["programs"][name] = measure(name, options.graphs, options)
        print(line_of(name, run["programs"][name], time.monotonic() - begin), flush=True)
        write(report, options.output)
    print("\n" + judge.table(report), end="")
    if options.wrong:
        print("\n" + judge.wrong_table(run), end="")
    if options.plot:
        judge.draw(run, options.plot)


if __name__ == "__main__":
    main()
