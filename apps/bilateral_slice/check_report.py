#!/usr/bin/env python3
"""Prints the results of a run of bilateral_slice, and fails if they are not what the demo promises.

usage: check_report.py report.json
"""
import json
import sys

# key, comparison, limit
PROMISES = [
    ("psnr_final_db", ">=", 32.0),
    ("psnr_gain_db", ">=", 10.0),
    ("gradient_check_max_relative_error", "<=", 1e-3),
    ("ratio_to_halide", ">=", 3.0),
]


def holds(value, comparison, limit):
    if value is None:
        return False
    return value >= limit if comparison == ">=" else value <= limit


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    report["psnr_gain_db"] = report["psnr_final_db"] - report["psnr_initial_db"]
    broken = 0
    for key, comparison, limit in PROMISES:
        if key == "ratio_to_halide" and report[key] is None and not report["halide_missing_because"]:
            print("       ratio_to_halide: nobody asked for Halide")
            continue
        kept = holds(report[key], comparison, limit)
        broken += not kept
        value = "not measured" if report[key] is None else f"{report[key]:.4g}"
        print(f"{'ok    ' if kept else 'BROKEN'} {key} = {value} ({comparison} {limit:g})")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
