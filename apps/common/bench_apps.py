#!/usr/bin/env python3
"""Runs the bench script of every app, or of the named ones, and collects their reports.

usage: bench_apps.py BIN --output=FILE [NAME...]

apps/NAME/bench BIN FOLDER writes FOLDER/report.json (common/report.h) and its plots. FILE receives all reports;
the FOLDERs are beside it, in apps/.
"""
import json
import os
import platform
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
APPS = os.path.dirname(HERE)


def benches():
    names = sorted(os.listdir(APPS))
    return [name for name in names if os.access(os.path.join(APPS, name, "bench"), os.X_OK)]


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    return names[0] if names else platform.machine()


def measure(name, programs, folder):
    """The app's report, or None if its script failed."""
    os.makedirs(folder, exist_ok=True)
    print(f"== {name}", flush=True)
    outcome = subprocess.run([os.path.join(APPS, name, "bench"), programs, folder], check=False)
    path = os.path.join(folder, "report.json")
    if outcome.returncode != 0 or not os.path.exists(path):
        return None
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def write_whole(path, text):
    temporary = f"{path}.{os.getpid()}.tmp"
    with open(temporary, "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(temporary, path)


def main():
    outputs = [a.split("=", 1)[1] for a in sys.argv[1:] if a.startswith("--output=")]
    words = [a for a in sys.argv[1:] if not a.startswith("--")]
    if len(outputs) != 1 or not words:
        sys.exit(__doc__.strip())
    programs, wanted = words[0], words[1:] or benches()
    unknown = [name for name in wanted if name not in benches()]
    if unknown:
        sys.exit(f"cannot measure {', '.join(unknown)}: an app needs a bench script; "
                 f"there are: {', '.join(benches()) or 'none'}. Give some of these.")
    folder = os.path.join(os.path.dirname(outputs[0]), "apps")
    reports = {name: measure(name, programs, os.path.join(folder, name)) for name in wanted}
    machine = {"processor": processor(), "cores": os.cpu_count()}
    write_whole(outputs[0], json.dumps({"machine": machine, "apps": reports}, indent=1) + "\n")
    failed = [name for name, report in reports.items() if report is None]
    print(f"report in {outputs[0]}")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
