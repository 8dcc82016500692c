"""compare -- checks that a Python program prints the same as its C++ counterpart.

    compare.py WORK SCRIPT PROGRAM     runs each in its own folder below WORK; compares both streams
"""
import difflib
import shutil
import subprocess
import sys
from pathlib import Path


def output_of(command, folder):
    folder.mkdir(parents=True)
    done = subprocess.run([*command, "."], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command} failed: {done.returncode}\n{done.stderr}")
    return done.stdout.splitlines(True), done.stderr.splitlines(True)


def main(work, script, program):
    shutil.rmtree(work, ignore_errors=True)
    ours = output_of([sys.executable, "-u", "-B", script], Path(work, "python"))
    peers = output_of([program], Path(work, "cpp"))
    if not peers[0]:
        sys.exit(f"{program} printed nothing")
    difference = [line for a, b in zip(peers, ours) for line in difflib.unified_diff(a, b, "C++", "Python")]
    sys.stdout.writelines(difference)
    sys.exit(1 if difference else 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
