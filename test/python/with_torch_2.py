"""Runs a test with the PyTorch 2 that `bench/operators/peers.py pytorch` installs under out/bench/peers, or ends with
77, which ctest counts as skipped, where that is not there.

    with_torch_2.py TEST [argument...]"""
import os
import subprocess
import sys
from pathlib import Path

python = Path(__file__).resolve().parents[2] / "out" / "bench" / "peers" / "bin" / "python"
found = python.exists() and subprocess.run([python, "-c", "import torch"], capture_output=True).returncode == 0
if not found:
    print(f"skipped: {python} has no PyTorch. `python3 bench/operators/peers.py pytorch` installs it")
    sys.exit(77)
os.execv(python, [str(python), "-B", *sys.argv[1:]])
