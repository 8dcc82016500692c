#!/usr/bin/env python3
"""Prints the results of a run of burst_superresolution on a photograph, and fails if they are not as promised.

usage: check_report.py report.json

The picture is at least 2 dB better than the better of AHD and the bicubic average, its homographies are nearer to the
truth than the initial ones, and everything takes at most a minute.
"""
import json
import sys


def promises(own):
    yield "gain_db", own["gain_db"], ">=", 2.0
    error = own["motion_error_px"]
    yield "homography error [px]", error["end"]["mean"], "<=", error["start"]["mean"]
    yield "seconds", own["seconds"]["total"], "<=", 60.0


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        own = json.load(file)["burst_superresolution"]
    broken = 0
    for name, value, comparison, limit in promises(own):
        kept = value >= limit if comparison == ">=" else value <= limit
        broken += not kept
        print(f"{'ok    ' if kept else 'BROKEN'} {name} = {value:.4g} ({comparison} {limit:.4g})")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
