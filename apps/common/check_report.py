#!/usr/bin/env python3
"""Prints what an app's report promises and whether it keeps it; fails if it does not.

usage: check_report.py report.json [--times]

--times: also checks run times, which hold on two idle cores only (demosaic).
"""
import json
import sys


class Promises:
    """The lines to print, and the reason to fail: a message, a status, or 0."""

    def __init__(self):
        self.lines, self.failure = [], 0

    def require(self, name, value, comparison, limit, value_format=".4g", limit_format=".4g"):
        """A value that must lie on one side of a limit; None is a value that was not measured."""
        kept = value is not None and (value >= limit if comparison == ">=" else value <= limit)
        shown = "not measured" if value is None else f"{value:{value_format}}"
        self.lines.append(f"{'ok    ' if kept else 'BROKEN'} {name} = {shown} ({comparison} {limit:{limit_format}})")
        if not kept:
            self.failure = 1


def bilateral_slice(promises, report, _):
    promises.require("psnr_final_db", report["psnr_final_db"], ">=", 32.0)
    promises.require("psnr_gain_db", report["psnr_final_db"] - report["psnr_initial_db"], ">=", 10.0)
    promises.require("gradient_check_max_relative_error", report["gradient_check_max_relative_error"], "<=", 1e-3)
    ratio = report["ratio_to_halide"]
    if ratio is None and not report["halide_missing_because"]:
        promises.lines.append("       ratio_to_halide: nobody asked for Halide")
    else:
        promises.require("ratio_to_halide", ratio, ">=", 3.0)


def burst_superresolution(promises, report, _):
    """Better than the better of AHD and the bicubic average, and homographies nearer to the truth, within a minute."""
    own = report["burst_superresolution"]
    promises.require("gain_db", own["gain_db"], ">=", 2.0)
    error = own["motion_error_px"]
    promises.require("homography error [px]", error["end"]["mean"], "<=", error["start"]["mean"])
    promises.require("seconds", own["seconds"]["total"], "<=", 60.0)


def deconvolution(promises, report, _):
    """On the held-out photographs, learned weights beat original and tuned numbers, and all beat the blurred input."""
    db = report["deconvolution"]["held_out"]
    for better, worse, limit in (("learned", "original", 0.8), ("learned", "tuned", 0.5), ("original", "blurred", 0)):
        promises.require(f"{better} over {worse} [dB]", db[better] - db[worse], ">=", limit, "+.2f", "")


def demosaic(promises, report, with_times):
    """On the held-out photographs, nine filters beat AHD: the shipped ones, and those learned in two minutes."""
    shipped_gain_db, learned_gain_db, most_ms = 0.8, 0.6, 40
    methods, failed = report["demosaic"]["methods"], []
    for name, method in methods.items():
        if not name.startswith("relaxed 9 5x5"):
            continue
        gain = method["psnr_srgb_db"] - methods["AHD"]["psnr_srgb_db"]
        ms = method["ms_per_megapixel"]
        promises.lines.append(f"{name}: {gain:+.2f} dB over AHD, {ms:.1f} ms per megapixel")
        least = learned_gain_db if name.endswith("steps") else shipped_gain_db
        if gain < least or (with_times and ms >= most_ms):
            failed.append(name)
    if failed:
        promises.failure = f"below what is promised: {', '.join(failed)}"


def fluid(promises, report, _):
    own, least_gain_db = report["fluid"], 8
    gain = own["psnr_final_db"] - own["psnr_initial_db"]
    memory, limit = report["peak_memory_mb"], report["options"]["memory_mb"]
    promises.lines.append(
        f"PSNR {own['psnr_initial_db']:.2f} -> {own['psnr_final_db']:.2f} dB, {own['frames']} frames of "
        f"{own['width']} x {own['height']}, {own['ms_per_gradient']:.1f} ms a gradient, "
        f"{report['seconds']:.1f} s, {memory:.0f} MB")
    broken = []
    if not report["stopped"] and gain < least_gain_db:
        broken.append(f"the smoke came only {gain:.1f} dB nearer to the picture, "
                      f"at least {least_gain_db} are promised")
    if memory > limit:
        broken.append(f"it took {memory:.0f} MB of {limit:.0f}")
    if broken:
        promises.failure = "the demo breaks its promise: " + "; ".join(broken)


def lens(promises, report, _):
    own = report["lens"]
    promises.require("shorter_percent", own["shorter_percent"], ">=", 10.0)
    promises.require("spot_after_um", own["spot_after_um"], "<=", own["spot_before_um"])
    promises.require("light_after", own["light_after"], ">=", 0.98 * own["light_before"])
    promises.require("focal_length_after", own["focal_length_after"], ">=", 0.995 * own["focal_length_before"])
    promises.require("focal_length_after", own["focal_length_after"], "<=", 1.005 * own["focal_length_before"])


APPS = {"bilateral_slice": bilateral_slice, "burst_superresolution": burst_superresolution,
        "deconvolution": deconvolution, "demosaic": demosaic, "fluid": fluid, "lens": lens}


def main():
    words = [word for word in sys.argv[1:] if word != "--times"]
    if len(words) != 1:
        sys.exit(__doc__.strip())
    with open(words[0], encoding="utf-8") as file:
        report = json.load(file)
    promises = Promises()
    APPS[report["program"]](promises, report, "--times" in sys.argv)
    for line in promises.lines:
        print(line)
    sys.exit(promises.failure)


if __name__ == "__main__":
    main()
