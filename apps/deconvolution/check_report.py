#!/usr/bin/env python3
"""Checks what a report of deconvolution promises, and prints one line for each promise.

usage: check_report.py report.json

On the held-out photographs, the learned weights beat the original numbers by 0.8 dB and the tuned ones by 0.5 dB; all
of them beat the blurred photographs.
"""
import json
import sys

OVER_ORIGINAL_DB, OVER_TUNED_DB = 0.8, 0.5


def promises(db):
    yield "learned over original [dB]", db["learned"] - db["original"], OVER_ORIGINAL_DB
    yield "learned over tuned [dB]", db["learned"] - db["tuned"], OVER_TUNED_DB
    yield "original over blurred [dB]", db["original"] - db["blurred"], 0


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        db = json.load(file)["deconvolution"]["held_out"]
    broken = 0
    for name, value, limit in promises(db):
        kept = value >= limit
        broken += not kept
        print(f"{'ok    ' if kept else 'BROKEN'} {name} = {value:+.2f} (>= {limit})")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
