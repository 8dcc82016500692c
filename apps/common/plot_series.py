#!/usr/bin/env python3
"""Draws the plots that a report lists, each to its own PNG.

usage: plot_series.py report.json FOLDER
"""
import os

from figures import draw_report, plt, save


def drawable(series, plot):
    """The points that these axes can show; null means a value that was not finite."""
    for n, (x, y) in enumerate(zip(series["x"], series["y"])):
        if x is None or y is None or (plot["log_x"] and x <= 0) or (plot["log_y"] and y <= 0):
            continue
        yield n, x, y


# Candidate positions of a label relative to its point, in points; the nearest free one is used.
PLACES = [(side * (5 + 3 * far), up * (5 + 9 * far) - 3) for far in range(5) for side in (1, -1) for up in (0, 1, -1)]


def place_labels(figure, axes, labels):
    """Places each label beside its point, overlapping no other label or point if possible."""
    renderer = figure.canvas.get_renderer()
    dots = [axes.transData.transform((x, y)) for _, x, y in labels]
    frame, taken = axes.get_window_extent(renderer), []
    for n, (text, x, y) in enumerate(labels):
        for dx, dy in PLACES:
            label = axes.annotate(text, (x, y), textcoords="offset points", xytext=(dx, dy), fontsize=8,
                                  ha="left" if dx > 0 else "right",
                                  arrowprops={"arrowstyle": "-", "lw": 0.4} if abs(dy) > 12 else None)
            box = label.get_window_extent(renderer)
            is_free = (frame.x0 <= box.x0 and box.x1 <= frame.x1 and not any(box.overlaps(other) for other in taken)
                       and not any(box.contains(*dot) for m, dot in enumerate(dots) if m != n))
            if is_free or (dx, dy) == PLACES[-1]:
                taken.append(box)
                break
            label.remove()


def add_series(axes, series, plot, labels):
    """Draws a series and returns whether there was anything to draw; adds its labels to `labels`."""
    points = list(drawable(series, plot))
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    if not series["labels"]:
        axes.plot(xs, ys, label=series["name"], marker="." if len(points) < 3 else None)
        return bool(points)
    axes.plot(xs, ys, "o", label=series["name"])
    labels += [(series["labels"][n], x, y) for n, x, y in points]
    return bool(points)


def draw(plot, path):
    figure, axes = plt.subplots(figsize=(8, 5), dpi=120)
    # Axes without points cannot be logarithmic.
    labels = []
    drawn = [add_series(axes, series, plot, labels) for series in plot["series"]]
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
    place_labels(figure, axes, labels)
    save(figure, path)


def draw_all(report, folder):
    for plot in report["plots"]:
        draw(plot, os.path.join(folder, plot["file"]))


if __name__ == "__main__":
    draw_report(__doc__, draw_all)
