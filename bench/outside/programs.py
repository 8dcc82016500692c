"""programs.py -- the programs of `tools/bench outside`, by name, and those on which the compiler is not tuned."""
import geometry
import imaging
import layers
import losses
import pde
import recurrences
import signals
from program import PROGRAMS

MODULES = (pde, recurrences, signals, imaging, geometry, losses, layers)
FIELD_OF = {name: program.__module__ for name, program in PROGRAMS.items()}
# Changes of the compiler are judged by these ten, but not made for them.
HELD_OUT = ("wave_receivers", "red_black_pressure", "tridiagonal_rows", "soft_dtw", "polyphase_resample",
            "structure_tensor", "splat_points", "spline_deformation", "mutual_information", "dilated_gate")
