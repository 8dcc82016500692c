"""retrograde.imageio under the name that Halide's package uses."""
from retrograde.imageio import *  # noqa: F401,F403
