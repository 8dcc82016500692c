#!/usr/bin/env python3
"""Draws a lens with its rays, before and after, and its spot diagrams, from the "drawings" of report.json.

usage: draw_lens.py report.json FOLDER      writes lens_before.png, lens_after.png, spots.png
"""
import os

from figures import draw_report, plt, save

WAVELENGTH_COLOURS = ["#2255cc", "#229944", "#cc3322"]
FIELD_COLOURS = ["#1f77b4", "#2ca02c", "#ff7f0e", "#d62728"]
GLASS = "#cfe3f2"


def draw_glass(axes, profiles):
    for front, back in zip(profiles, profiles[1:]):
        if not front["glass"]:
            continue
        z = front["z"] + back["z"][::-1]
        y = front["y"] + back["y"][::-1]
        axes.fill(z, y, color=GLASS, zorder=1)
        axes.plot(z + z[:1], y + y[:1], color="#446688", linewidth=0.8, zorder=2)


def draw_stop(axes, profile):
    edge, z = profile["rim"], profile["z"][0]
    for side in (1, -1):
        axes.plot([z, z], [side * edge, side * edge * 1.35], color="black", linewidth=1.6)


def draw_system(drawing, limits, path):
    figure, axes = plt.subplots(figsize=(11, 4.6), dpi=110)
    draw_glass(axes, drawing["profiles"])
    for profile in drawing["profiles"]:
        if profile["stop"]:
            draw_stop(axes, profile)
    for ray in drawing["rays"]:
        axes.plot(ray["z"], ray["y"], color=FIELD_COLOURS[ray["field"] % 4], linewidth=0.5, zorder=3)
    axes.axvline(drawing["image"], color="black", linewidth=1.2)
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.set_aspect("equal")
    axes.set_xlabel("mm")
    axes.set_title(drawing["title"])
    figure.tight_layout()
    save(figure, path)


def draw_spots(drawings, path):
    columns = len(drawings[0]["spots"])
    figure, grid = plt.subplots(len(drawings), columns, figsize=(2.7 * columns, 2.9 * len(drawings)), dpi=110,
                                squeeze=False)
    reach = max(spot["rms"] for drawing in drawings for spot in drawing["spots"]) * 3
    for row, drawing in zip(grid, drawings):
        for axes, spot in zip(row, drawing["spots"]):
            for n, points in enumerate(spot["points"]):
                axes.plot(points["x"], points["y"], ".", markersize=1.5,
                          color=WAVELENGTH_COLOURS[n % 3] if len(spot["points"]) > 1 else "#229944")
            axes.set_xlim(-reach, reach)
            axes.set_ylim(-reach, reach)
            axes.set_aspect("equal")
            axes.tick_params(labelsize=7)
            axes.set_title(f"{drawing['name']}, {spot['degrees']:.1f}°\nrms {1e3 * spot['rms']:.1f} µm", fontsize=9)
    figure.tight_layout()
    save(figure, path)


def limits_of(drawings):
    z = [v for d in drawings for ray in d["rays"] for v in ray["z"]] + [d["image"] for d in drawings]
    y = [v for d in drawings for ray in d["rays"] for v in ray["y"]]
    y += [v for d in drawings for profile in d["profiles"] for v in profile["y"]]
    return (min(z) - 2, max(z) + 3), (min(y) - 2, max(y) + 2)


def draw(report, folder):
    drawings = report["lens"]["drawings"]
    limits = limits_of(drawings)
    for drawing in drawings:
        draw_system(drawing, limits, os.path.join(folder, f"lens_{drawing['name']}.png"))
    draw_spots(drawings, os.path.join(folder, "spots.png"))


if __name__ == "__main__":
    draw_report(__doc__, draw)
