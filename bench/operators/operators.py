#!/usr/bin/env python3
"""operators.py -- compares operators with all their gradients with the newest Halide and PyTorch, in one run.

    operators.py PROGRAMS [--operator NAME]... [--quick] [--rounds N] [--threads N]
                 [--peers none|halide|pytorch|all] [--output FILE] [--add] [--small] [--search]

PROGRAMS is the folder of bench_operators_retrograde and bench_machine. The peers are installed from the
Python package index into a virtual environment, out/bench/peers, which is created if missing: Halide's
wheel, with which the Halide worker is built from the same source as ours, and PyTorch. All workers of an
operator are separate processes that implement ../pairs/worker_protocol.h, and run in turn. Failures of
a peer are listed in the report under `failures` and do not end the run. ../README.md explains the
figures.
"""
import argparse
import glob
import json
import os
import re
import selectors
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np

from peers import PEERS, make_peers, site_packages, version

HERE = os.path.dirname(os.path.abspath(__file__))
SCHEDULES = ["Adams2019", "Li2018", "Mullapudi2016", "root"]  # of Halide
SEARCH_SECONDS = 60  # for a schedule by Halide, including compilation
SEARCHED = "retrograde_search"  # ours, with AutoscheduleOptions::search
RUN_SECONDS = 240  # for one run of a worker, and for torch.compile
PAUSE_SECONDS = 0.03  # before a turn, because idle OpenMP threads spin for this long
WARM_SECONDS = 0.02  # of untimed runs in a turn, because after the pause caches are cold and clocks are low
COLD_SECONDS = 0.2  # a run of this length needs no warm-up
PEER_SECONDS = 8  # for all rounds of a slow worker; it runs at least once


def operator_names():
    with open(os.path.join(HERE, "list.def"), encoding="utf-8") as file:
        return re.findall(r"^OPERATOR\((\w+)\)", file.read(), re.M)


# ---- workers ----

def last_of_turn(run):
    """The time of one run in a sequence of runs, in seconds; `run` returns the time of one run."""
    time.sleep(PAUSE_SECONDS)
    spent = 0
    while True:
        seconds = run()
        if spent >= WARM_SECONDS or seconds >= COLD_SECONDS:
            return seconds
        spent += seconds



def saved_arrays(path):
    """The arrays in a file of OutputHeaders and elements."""
    with open(path, "rb") as file:
        data, at = file.read(), 0
    while at < len(data):
        code, bits, count = struct.unpack_from("<iiq", data, at)
        yield np.frombuffer(data, f"{'iuf'[code]}{bits // 8}", count, at + 16).astype(np.float64)
        at += 16 + count * bits // 8


def errors_of(a, b):
    """The largest |a - b| / max(|b|, root mean square of b), and |a - b| / |b|."""
    difference, size = np.abs(a - b), max(np.linalg.norm(b), np.finfo(float).tiny)
    scale = size / np.sqrt(b.size)
    return np.max(difference / np.maximum(np.abs(b), scale)), np.linalg.norm(difference) / size


class Failed(Exception):
    pass


class Worker:
    """A worker named "retrograde", "pytorch", "pytorch_compiled", or after a schedule of Halide."""

    def __init__(self, name, command, threads, seconds):
        self.name, self.line, self.times, self.failure = name, b"", [], None
        self.command = command
        self.said = tempfile.TemporaryFile()
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.said, bufsize=0,
            env={**os.environ, "HL_NUM_THREADS": str(threads), "OMP_NUM_THREADS": str(threads),
                 "TORCHINDUCTOR_FORCE_DISABLE_CACHES": "1"})
        try:
            self.ready = self.answer("ready", seconds)
        except Failed as failed:
            self.fail(failed)

    def answer(self, expected, seconds=RUN_SECONDS):
        """Reads the worker's next line, which must begin with `expected`, and returns the numbers after it."""
        end = time.monotonic() + seconds
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            while b"\n" not in self.line:
                if not selector.select(end - time.monotonic()):
                    raise Failed(f"no answer within {seconds} s")
                read = os.read(self.process.stdout.fileno(), 65536)
                if not read:
                    raise Failed(self.last_words() or "it ended without a word")
                self.line += read
        line, self.line = self.line.split(b"\n", 1)
        word, *rest = line.decode().split()
        if word != expected:
            raise Failed(" ".join(rest))
        return [float(number) for number in rest]

    def last_words(self):
        self.said.seek(0)
        return " ".join(self.said.read().decode(errors="replace").split())[-600:]

    def ask(self, order, expected):
        if self.failure:
            raise Failed(self.failure)
        try:
            self.process.stdin.write(order.encode() + b"\n")
            return self.answer(expected)
        except (Failed, OSError) as failed:
            self.fail(failed)
            raise Failed(self.failure) from failed

    def fail(self, why):
        self.failure = str(why)[:600]
        self.close()

    def run(self):
        self.times.append(last_of_turn(lambda: self.ask("run", "ran")[0]) * 1e3)

    def has_enough(self):
        return self.failure or sum(self.times) > PEER_SECONDS * 1e3

    def median(self):
        return statistics.median(self.times) if self.times and not self.failure else None

    def close(self):
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout, self.said):
            pipe.close()


# ---- what the peers need ----

def build_halide_worker(what, files, definition):
    """From one text that includes all others: most of its compilation is that of Halide.h. `files` hold
    what is run, relative to bench/."""
    halide = os.path.join(site_packages(), "halide")
    libraries = os.path.join(halide, "lib64")
    sources = ["gradients/gradient.cpp", "gradients/slope.cpp", "operators/schedules.cpp", *files,
               "pairs/worker_main.cpp"]
    text = "".join(f'#include "{os.path.dirname(HERE)}/{source}"\n' for source in sources)
    unit, worker = (os.path.join(PEERS, what + "_halide" + end) for end in (".cpp", ""))
    with open(unit, "w", encoding="utf-8") as file:
        file.write(text)
    if os.path.exists(worker):
        newest = max(os.path.getmtime(file) for folder in ("gradients", "operators", "pairs", "kernels")
                     for file in glob.glob(os.path.join(os.path.dirname(HERE), folder, "*.*")))
        if newest < os.path.getmtime(worker):
            return worker
    subprocess.run(["g++", "-std=c++20", "-O1", "-D" + definition,
                    f'-DBENCH_HALIDE_PLUGINS="{libraries}"', f"-I{halide}/include", unit, "-o", worker,
                    f"-L{libraries}", "-lHalide", f"-Wl,-rpath,{libraries}"], check=True)
    return worker


# ---- one operator ----

def start_workers(name, options, scratch):
    size, threads = "small" if options.small else "full", str(options.threads)

    def start(worker, command, seconds=RUN_SECONDS):
        print(f"\r{name}: {worker}".ljust(50), end="\r", file=sys.stderr, flush=True)
        return Worker(worker, command, options.threads, seconds)

    workers = [start("retrograde", [os.path.join(options.programs, "bench_operators_retrograde"),
                                    name, size, threads])]
    if options.search:
        workers.append(start(SEARCHED, [*workers[0].command, "search=true"]))
    path = os.path.join(scratch, "inputs")
    shapes = [str(int(n)) for n in workers[0].ask("inputs " + path, "saved")]
    if options.halide_worker:
        workers += [start(schedule, [options.halide_worker, name, size, threads, schedule],
                          SEARCH_SECONDS) for schedule in SCHEDULES]
    torch = [os.path.join(PEERS, "bin", "python"), os.path.join(HERE, "pytorch_worker.py"), name]
    if "pytorch" in options.kinds:
        workers += [start(worker, [*torch, mode, threads, path, *shapes]) for worker, mode in
                    (("pytorch", "eager"), ("pytorch_compiled", "compiled"))]
        return workers, [*torch, "float64", threads, path, *shapes]
    return workers, [os.path.join(options.programs, "bench_operators_float64"), name, size, threads]


def run_in_turn(workers, rounds):
    """The first run of a process creates its threads and touches its memory. It only counts if there is no
    time for another run."""
    for at in range(-1, rounds):
        for i in range(len(workers)):
            worker = workers[(i + at) % len(workers)]
            if worker.has_enough():
                continue
            try:
                worker.run()
                if at < 0 and not worker.has_enough():
                    worker.times.clear()
            except Failed:
                pass  # the report contains the reason


def compare(workers, reference, options, scratch):
    """The errors of each C++ worker that has run, relative to float64, by name."""
    double = Worker("float64", reference, options.threads, 5 * RUN_SECONDS)
    if double.failure:
        return {"reference": double.failure}
    result, path, exact = {}, os.path.join(scratch, "outputs"), os.path.join(scratch, "exact")
    if not reference[0].endswith("python"):
        double.run()
    double.ask("save " + exact, "saved")
    double.close()
    for worker in workers:
        if worker.failure or worker.name.startswith("pytorch"):
            continue
        worker.ask("save " + path, "saved")
        pairs = zip(saved_arrays(path), saved_arrays(exact))
        largest, norm = zip(*(errors_of(a, b) for a, b in pairs))
        result[worker.name] = {"largest": largest, "norm": norm}
    return result


def memory_of(worker, inputs_mb):
    """The memory of an operator: what a run allocates, plus the inputs."""
    try:
        return worker.ask("memory", "memory")[1] + inputs_mb
    except Failed:
        return None


def figures(name, workers, errors, machine, scratch):
    by_name = {worker.name: worker for worker in workers}
    ours = by_name["retrograde"]
    done = {w.name: w.median() for w in workers if w.median() is not None}
    halide = {s: done.get(s) for s in SCHEDULES if s in by_name}
    best = min((s for s in halide if halide[s]), key=halide.get, default=None)
    inputs_mb = os.path.getsize(os.path.join(scratch, "inputs")) / 2**20
    row = {"operator": name, "threads": machine["threads"],
           "rounds": {w.name: len(w.times) for w in workers},
           "retrograde_ms": done.get("retrograde"), "halide_ms": halide, "halide_best": best,
           "halide_best_ms": halide.get(best), "pytorch_ms": done.get("pytorch"),
           "pytorch_compiled_ms": done.get("pytorch_compiled"),
           "spread_ms": {w.name: spread(w.times) for w in workers if w.times},
           "failures": {w.name: w.failure for w in workers if w.failure}}
    if not ours.failure:
        compile_s, _, moved, operations, derive_s, search_s = ours.ready
        row |= {"compile_s": compile_s + derive_s, "search_s": search_s, "bytes": moved,
                "operations": operations,
                "bound_ms": 1e3 * max(moved / machine["bytes_per_second"], operations / machine["flops"])}
    if SEARCHED in by_name:
        row["searched_ms"] = done.get(SEARCHED)
        if not by_name[SEARCHED].failure:
            row["search_s"] = by_name[SEARCHED].ready[5]
    row["halide_compile_s"] = {s: w.ready[0] + w.ready[4] for s in halide
                               if not (w := by_name[s]).failure}
    row["halide_search_s"] = {s: w.ready[5] for s in halide if not (w := by_name[s]).failure}
    if "pytorch_compiled" in done:
        row["pytorch_compile_s"] = by_name["pytorch_compiled"].ready[0]
    for key, who in (("peak_mb", "retrograde"), ("halide_best_peak_mb", best),
                     ("pytorch_peak_mb", "pytorch"), ("pytorch_compiled_peak_mb", "pytorch_compiled")):
        row[key] = memory_of(by_name[who], inputs_mb) if who in done else None
    row["errors"] = errors
    for key, kind in (("max_relative_error", "largest"), ("norm_error", "norm")):
        row[key] = max(errors["retrograde"][kind]) if "retrograde" in errors else None
    return row


def spread(times):
    """The interquartile range."""
    if len(times) < 4:
        return max(times) - min(times)
    low, _, high = statistics.quantiles(times, n=4)
    return high - low


def measure(name, options, machine):
    with tempfile.TemporaryDirectory(dir=options.scratch) as scratch:
        workers, reference = start_workers(name, options, scratch)
        try:
            try:
                run_in_turn(workers, options.rounds)
                errors = compare(workers, reference, options, scratch)
            except KeyboardInterrupt:  # what has been timed stays
                options.interrupted, errors = True, {}
            return figures(name, workers, errors, machine, scratch)
        finally:
            for worker in workers:
                if not worker.failure:
                    worker.close()


# ---- the report ----

def is_wrong(row):
    """Whether our pipeline fails, or its results differ from those in float64."""
    if row["retrograde_ms"] is None:
        return True
    searched = row["errors"].get(SEARCHED)
    return not (max(row["norm_error"] or 0, *(searched["norm"] if searched else [0]))) <= 1e-3


def line(row):
    def cell(value, form="9.2f"):
        return format(value, form) if value is not None else "-".rjust(int(form.split(".")[0]))

    halide = " ".join(f"{s} {cell(t, '.2f') if t else 'failed'}" for s, t in row["halide_ms"].items())
    return (f"{row['operator']:22}{cell(row['retrograde_ms'])}{cell(row['halide_best_ms'])}"
            f"{cell(row['pytorch_ms'])}{cell(row['pytorch_compiled_ms'])}{cell(row.get('bound_ms'))}"
            f"{cell(row['peak_mb'], '8.0f')}{cell(row['norm_error'], '10.1e')}  {halide}"
            + (f"  searched {cell(row['searched_ms'], '6.2f')} in {cell(row.get('search_s'), '4.1f')} s"
               if "searched_ms" in row else "")
            + ("  WRONG" if is_wrong(row) else ""))


def write(path, report):
    with open(path + ".new", "w", encoding="utf-8") as file:
        json.dump(report, file, indent=1)
    os.replace(path + ".new", path)


def read_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("programs")
    parser.add_argument("--operator", action="append", choices=operator_names(), dest="operators")
    parser.add_argument("--quick", action="store_true", help="few rounds; the numbers are only rough")
    parser.add_argument("--rounds", type=int, help="timed runs of each; default: 15")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--peers", choices=["none", "halide", "pytorch", "all"], default="all")
    parser.add_argument("--search", action="store_true", help="also run our autoscheduler with its search")
    parser.add_argument("--small", action="store_true", help="small sizes, to check the results")
    parser.add_argument("--add", action="store_true", help="keep the other operators of an earlier report")
    parser.add_argument("--output", default="operators.json")
    options = parser.parse_args()
    options.rounds = options.rounds or (5 if options.quick else 15)
    options.kinds = {"none": [], "all": ["halide", "pytorch"]}.get(options.peers, [options.peers])
    options.scratch = os.path.dirname(os.path.abspath(options.output))
    options.halide_worker, options.interrupted = None, False
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return options


def main():
    options = read_options()
    versions = {}
    if options.kinds:
        make_peers(options.kinds)
        versions = {kind: version(kind) for kind in options.kinds}
    if "halide" in options.kinds:
        options.halide_worker = build_halide_worker(
            "operators", [f"operators/{name}.cpp" for name in operator_names()], "BENCH_OPERATORS")
    machine = json.loads(subprocess.check_output(
        [os.path.join(options.programs, "bench_machine"), str(options.threads)]))
    report = {"machine": machine, "versions": versions, "operators": []}
    if options.add and os.path.exists(options.output):
        with open(options.output, encoding="utf-8") as file:
            report["operators"] = json.load(file)["operators"]
    print(f"{machine['threads']} threads, {machine['bytes_per_second'] / 1e9:.1f} GB/s, "
          f"{machine['flops'] / 1e9:.0f} GFLOP/s; {versions}")
    print(f"{'ms':22}{'ours':>9}{'Halide':>9}{'eager':>9}{'compiled':>9}{'bound':>9}{'MB':>8}{'error':>10}")
    wrong = False
    for name in options.operators or operator_names():
        row = measure(name, options, machine)
        report["operators"] = [r for r in report["operators"] if r["operator"] != name] + [row]
        write(options.output, report)  # an interrupted run keeps what it has
        print(line(row), flush=True)
        wrong |= is_wrong(row)
        if options.interrupted:
            break
    print("report:", options.output)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
