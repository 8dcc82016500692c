#!/usr/bin/env python3
"""Draws error against run time, for both languages, from report.json.

usage: plot_error_against_time.py report.json plot.png
"""
from figures import draw_report, plt, save


def add_curve(axes, name, curve, ms_per_step):
    if curve["seconds"]:
        axes.plot(curve["seconds"], curve["psnr_db"], label=f"{name}: {ms_per_step:.1f} ms a step")


def draw(report, path):
    figure, axes = plt.subplots(figsize=(8, 5), dpi=120)
    add_curve(axes, "Retrograde", report["retrograde"], report["ms_per_step"])
    add_curve(axes, "Halide 14, Li2018", report["halide"], report["halide_ms_per_step"])
    axes.set_xlabel("run time of the steps [s]")
    axes.set_ylabel("PSNR against the target [dB]")
    axes.set_title(
        f"{report['width']} x {report['height']} pixels, {report['steps']} steps, "
        f"{report['threads']} threads"
    )
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.tight_layout()
    save(figure, path)


if __name__ == "__main__":
    draw_report(__doc__, draw)
