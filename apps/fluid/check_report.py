#!/usr/bin/env python3
"""Checks that a report of fluid keeps the demo's promises: check_report.py report.json"""
import json
import sys


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    own = report["fluid"]
    gain = own["psnr_final_db"] - own["psnr_initial_db"]
    print(f"PSNR {own['psnr_initial_db']:.2f} -> {own['psnr_final_db']:.2f} dB, {own['frames']} frames of "
          f"{own['width']} x {own['height']}, {own['ms_per_gradient']:.1f} ms a gradient, "
          f"{report['seconds']:.1f} s, {report['peak_memory_mb']:.0f} MB")
    broken = []
    if not report["stopped"] and gain < 8:
        broken.append(f"the smoke came only {gain:.1f} dB nearer to the picture, at least 8 are promised")
    if report["peak_memory_mb"] > report["options"]["memory_mb"]:
        broken.append(f"it took {report['peak_memory_mb']:.0f} MB of {report['options']['memory_mb']:.0f}")
    if broken:
        sys.exit("the demo breaks its promise: " + "; ".join(broken))


if __name__ == "__main__":
    main()
