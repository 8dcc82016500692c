#!/usr/bin/env python3
"""Prints the results of a run of lens, and fails if they are not what the demo promises.

usage: check_report.py report.json
"""
import json
import sys


def promises(own):
    yield "shorter_percent", own["shorter_percent"], ">=", 10.0
    yield "spot_after_um", own["spot_after_um"], "<=", own["spot_before_um"]
    yield "light_after", own["light_after"], ">=", 0.98 * own["light_before"]
    yield "focal_length_after", own["focal_length_after"], ">=", 0.995 * own["focal_length_before"]
    yield "focal_length_after", own["focal_length_after"], "<=", 1.005 * own["focal_length_before"]


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        own = json.load(file)["lens"]
    broken = 0
    for name, value, comparison, limit in promises(own):
        kept = value >= limit if comparison == ">=" else value <= limit
        broken += not kept
        print(f"{'ok    ' if kept else 'BROKEN'} {name} = {value:.4g} ({comparison} {limit:.4g})")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
