#!/usr/bin/env python3
"""Draws rabbit.png, the demo's target picture for the smoke, from nine ellipses.

usage: draw_rabbit.py rabbit.png [PIXELS]
"""
import sys

import matplotlib.image
import numpy as np

# Centre, half axes (both in hundredths of the picture's side), and angle of the first axis (degrees).
ELLIPSES = [
    (56, 68, 24, 20, 0),    # body
    (72, 76, 13, 13, 0),    # haunch
    (82, 70, 6, 6, 0),      # tail
    (34, 46, 14, 12, 0),    # head
    (41, 22, 4.5, 16, 12),  # ears
    (54, 25, 4.5, 16, 32),
    (40, 84, 9, 4, 0),      # feet
    (66, 87, 14, 4, 0),
    (40, 76, 7, 10, 0),     # chest
]
SAMPLES = 8  # along a side of a pixel


def coverage(pixels):
    """The share of each pixel that lies inside an ellipse."""
    at = (np.arange(pixels * SAMPLES) + 0.5) * 100 / (pixels * SAMPLES)
    x, y = np.meshgrid(at, at)
    inside = np.zeros(x.shape, bool)
    for middle_x, middle_y, a, b, degrees in ELLIPSES:
        turn = np.radians(degrees)
        u = (x - middle_x) * np.cos(turn) + (y - middle_y) * np.sin(turn)
        v = (y - middle_y) * np.cos(turn) - (x - middle_x) * np.sin(turn)
        inside |= (u / a) ** 2 + (v / b) ** 2 <= 1
    return inside.reshape(pixels, SAMPLES, pixels, SAMPLES).mean(axis=(1, 3))


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__.strip())
    pixels = int(sys.argv[2]) if len(sys.argv) == 3 else 256
    gray = coverage(pixels)
    matplotlib.image.imsave(sys.argv[1], np.dstack([gray] * 3))


if __name__ == "__main__":
    main()
