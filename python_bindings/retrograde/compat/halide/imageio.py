"""Pictures, under the name of Halide's package: see retrograde.imageio."""
from retrograde.imageio import *  # noqa: F401,F403
