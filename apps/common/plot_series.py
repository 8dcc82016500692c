#!/usr/bin/env python3
"""Draws the plots that a report lists, each into its own PNG.

usage: plot_series.py report.json FOLDER
"""
import json
import os
import sys

from figures import plt, save


def drawable(series, plot):
    """The points that have a place on these axes; null stands for what was not finite."""
    for n, (x, y) in enumerate(zip(series["x"], series["y"])):
        if x is None or y is None or (plot["log_x"] and x <= 0) or (plot["log_y"] and y <= 0):
            continue
        yield n, x, y


def add_series(axes, series, plot):
    """Whether there was anything to draw."""
    points = list(drawable(series, plot))
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    if not series["labels"]:
        axes.plot(xs, ys, label=series["name"], marker="." if len(points) < 3 else None)
        return bool(points)
    axes.plot(xs, ys, "o", label=series["name"])
    for n, x, y in points:
        axes.annotate(series["labels"][n], (x, y), textcoords="offset points", xytext=(5, 4), fontsize=8)
    return bool(points)


def draw(plot, path):
    figure, axes = plt.subplots(figsize=(8, 5), dpi=120)
    # Axes without a point cannot be logarithmic.
    drawn = [add_series(axes, series, plot) for series in plot["series"]]
    if plot["log_x"] and any(drawn):
        axes.set_xscale("log")
    if plot["log_y"] and any(drawn):
        axes.set_yscale("log")
    axes.set_xlabel(plot["x_label"])
    axes.set_ylabel(plot["y_label"])
    axes.set_title(plot["title"])
    axes.grid(alpha=0.3, which="both" if plot["log_y"] else "major")
    if any(series["name"] for series in plot["series"]):
        axes.legend()
    figure.tight_layout()
    save(figure, path)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    for plot in report["plots"]:
        draw(plot, os.path.join(sys.argv[2], plot["file"]))


if __name__ == "__main__":
    main()
