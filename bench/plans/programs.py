#!/usr/bin/env python3
"""programs.py -- collects the programs of all benchmarks as texts of graphs.

    programs.py BUILD FOLDER [--group NAME]...

Runs each benchmark and application once in its shortest form, while RETROGRADE_GRAPHS makes the compiler keep what it
schedules. FOLDER receives GROUP-NAME.graph; a run that schedules several graphs numbers them by decreasing size.
BUILD is the folder of a build, such as out/build/release. Files that exist are replaced.
"""
import argparse
import glob
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
BENCH = os.path.dirname(HERE)
APPS = os.path.join(os.path.dirname(BENCH), "apps")
MOST_SECONDS = 120  # for a run; the graphs that it has kept by then count
# Names of pipelines that warm up a compiler; shorter texts are no programs either.
OTHERS = re.compile(r"^(first|trivial|warm_up)")
SHORTEST = 300  # bytes of text
MOST_GRAPHS = 4  # of a run


def names_in(path, word):
    with open(os.path.join(BENCH, path), encoding="utf-8") as file:
        return re.findall(rf"^{word}\((\w+)\)", file.read(), re.M)


def app_runs(build, scratch):
    """The shortest runs of the applications that schedule what their usual runs do."""
    images, photo = os.path.join(APPS, "images"), os.path.join(APPS, "images", "raccoon.jpg")
    options = {
        "bilateral_slice": ["--input", photo, "--steps", "1"],
        "burst_superresolution": ["--input", photo, "--steps", "1"],
        "deconvolution": ["--dataset", images, "--steps", "1", "--brief"],
        "demosaic": ["--dataset", images, "--steps", "1"],
        "fluid": ["--input", os.path.join(APPS, "fluid", "rabbit.png"), "--optimize", "force", "--cells", "128",
                  "--frames", "40", "--steps", "1"],
        "lens": ["--input", os.path.join(APPS, "lens", "prescriptions", "tessar_1903.json"), "--optimize",
                 "curvatures,spacings,indices,conics", "--steps", "1", "--stages", "1"],
    }
    return {name: [os.path.join(build, "apps", name, name), "--output", scratch, *more]
            for name, more in options.items()}


def torch_names(group):
    """The operators of bench/torch, or the programs of bench/outside, whose names are those of their classes."""
    if group == "torch":
        with open(os.path.join(BENCH, "torch", "definitions.py"), encoding="utf-8") as file:
            return re.findall(r"\w+", re.search(r"^OPERATORS = .* in \(([^)]*)\)", file.read(), re.M | re.S).group(1))
    classes = []
    for path in sorted(glob.glob(os.path.join(BENCH, "outside", "*.py"))):
        with open(path, encoding="utf-8") as file:
            classes += re.findall(r"^class (\w+)\(Program\)", file.read(), re.M)
    return [re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower() for name in classes]


def torch_runs(build, group):
    """Each in a process of its own, made and called by torch_programs.py."""
    script = os.path.join(HERE, "torch_programs.py")
    return {name: [sys.executable, script, os.path.join(build, "python"), group, name] for name in torch_names(group)}


def runs_of(group, build, scratch):
    """The command of each program of a group."""
    bench = os.path.join(build, "bench")
    if group == "operators":
        return {n: [f"{bench}/bench_operators_retrograde", n, "full", "2"] for n in
                names_in("operators/list.def", "OPERATOR")}
    if group == "pairs":
        return {n: [f"{bench}/bench_kernels_retrograde", n, "full", "2"] for n in names_in("list.def", "GRADIENT")}
    if group == "kernels":
        return {n: [f"{bench}/bench_kernels_retrograde", n, "full", "2", "Retrograde"]
                for n in names_in("list.def", "KERNEL")}
    if group == "programs":
        return {n.removeprefix("gradient_"): [f"{bench}/bench_programs_retrograde", n, scratch]
                for n in names_in("programs/list.def", "GRADIENT")}
    if group == "apps":
        return app_runs(build, scratch)
    return torch_runs(build, group)


GROUPS = ("operators", "pairs", "kernels", "programs", "torch", "outside", "apps")


def run(command, kept):
    """Runs a command and returns the graphs that it keeps and their values, the longest first; of equal ones, one."""
    environment = {**os.environ, "RETROGRADE_GRAPHS": kept}
    try:
        subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       env=environment, timeout=MOST_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        pass
    texts = {}
    for path in sorted(glob.glob(os.path.join(kept, "*.graph"))):
        text = contents_of(path)
        if not OTHERS.match(os.path.basename(path)) and len(text) >= SHORTEST:
            texts[text] = contents_of(path + ".values") if os.path.exists(path + ".values") else ""
    return sorted(texts.items(), key=lambda kept: (-len(kept[0]), kept[0]))[:MOST_GRAPHS]


def contents_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def collect(build, folder, groups):
    """Writes the programs of the groups; prints those that kept none."""
    os.makedirs(folder, exist_ok=True)
    for group in groups:
        with tempfile.TemporaryDirectory() as scratch:
            for name, command in runs_of(group, build, scratch).items():
                with tempfile.TemporaryDirectory() as kept:
                    texts = run(command, kept)
                for number, (text, values) in enumerate(texts, 1):
                    path = os.path.join(folder, f"{group}-{name}" + (f"-{number}" if number > 1 else "") + ".graph")
                    write(path, text)
                    write(path + ".values", values)  # empty: none are known
                print(f"{group} {name}: {len(texts) or 'no'} graphs", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("build")
    parser.add_argument("folder")
    parser.add_argument("--group", action="append", choices=GROUPS)
    options = parser.parse_args()
    collect(options.build, options.folder, options.group or GROUPS)


if __name__ == "__main__":
    main()
