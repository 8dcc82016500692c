"""What scripts that draw share: matplotlib without a display, and figures that are written whole or not at all."""
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402, F401


def save(figure, path):
    """As PNG: drawn beside the picture, then renamed. Closes the figure."""
    temporary = f"{path}.{os.getpid()}.tmp"
    try:
        figure.savefig(temporary, format="png")
        os.replace(temporary, path)
    finally:
        plt.close(figure)
        if os.path.exists(temporary):
            os.remove(temporary)
