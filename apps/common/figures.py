"""Helpers for scripts that draw: matplotlib without a display, and figures that are written atomically."""
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402, F401


def save(figure, path):
    """Saves as PNG: to a temporary file beside the destination, which is then renamed. Closes the figure."""
    temporary = f"{path}.{os.getpid()}.tmp"
    try:
        figure.savefig(temporary, format="png")
        os.replace(temporary, path)
    finally:
        plt.close(figure)
        if os.path.exists(temporary):
            os.remove(temporary)


def draw_report(usage, draw):
    """Runs a script whose arguments are a report and where to draw: `draw(report, path)`."""
    if len(sys.argv) != 3:
        sys.exit(usage.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    draw(report, sys.argv[2])
