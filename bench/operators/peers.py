#!/usr/bin/python3
"""peers.py -- installs the newest Halide and PyTorch into a virtual environment, out/bench/peers, created if missing.

    peers.py [halide] [pytorch]

Packages come from the Python package index. Benchmarks run this by themselves; tests only use what is installed.
"""
import glob
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PEERS = os.path.join(ROOT, "out", "bench", "peers")
PYTORCH = "torch==2.13.0"
CPU_WHEELS = "torch==2.13.0+cpu"  # a tenth of the size, if the index has it


def site_packages():
    return glob.glob(os.path.join(PEERS, "lib", "python3*", "site-packages"))[0]


def make_peers(kinds):
    wanted = {"halide": ["halide"], "pytorch": [PYTORCH, "numpy"]}
    if not os.path.exists(os.path.join(PEERS, "bin", "pip")):
        subprocess.run(["/usr/bin/python3", "-m", "venv", PEERS], check=True)
    for kind in kinds:
        if version(kind):
            continue
        pip = [os.path.join(PEERS, "bin", "pip"), "install", "--quiet"]
        if kind == "pytorch" and subprocess.run([*pip, CPU_WHEELS, "numpy"], capture_output=True).returncode == 0:
            continue
        subprocess.run([*pip, *wanted[kind]], check=True)


def version(kind):
    name = {"halide": "halide", "pytorch": "torch"}[kind]
    found = glob.glob(os.path.join(site_packages(), name + "-*.dist-info"))
    return os.path.basename(found[0]).split("-")[1].removesuffix(".dist") if found else None


if __name__ == "__main__":
    make_peers(sys.argv[1:])
