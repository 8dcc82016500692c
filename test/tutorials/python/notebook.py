"""Notebook output and introspection: loops, pictures, signatures, messages."""
import numpy as np
import retrograde as rg
from gradients.claims import claim

x, y = rg.Var("x"), rg.Var("y")

# ---- A notebook shows a Func as the loops of its schedule. ----
f = rg.Func("f")
f[x, y] = x ^ y
f.vectorize(x, 8).parallel(y)
shown = f._repr_html_()  # the method that notebooks call
claim("parallel" in shown and "vectorized" in shown, "the cell of a Func shows its loops")

# ---- It shows a Buffer as a picture (PNG). ----
picture = f.realize([256, 256])
claim(picture._repr_png_().startswith(b"\x89PNG"), "the cell of a Buffer shows its picture")

# ---- repr() describes an object. ----
claim(repr(f) == f"<retrograde.Func {f.name()}(x, y) of int32>", repr(f))
claim("[0, 256)" in repr(picture), repr(picture))
claim(str(rg.clamp(x, 0, 9) * 2) != "", f"an expression is its text: {rg.clamp(x, 0, 9) * 2}")

# ---- help(rg.Func.tile) shows the text of the C++ header, with the loops before and after. ----
claim("=>" in rg.Func.compute_root.__doc__, "the docstring of a directive shows the loops before and after")

# ---- Errors are exceptions; their four parts are attributes. ----
try:
    f.unroll(rg.Var("z"))
    claim(False, "a loop that does not exist was unrolled")
except rg.CompileError as error:
    for part in ("asked", "rule", "evidence", "instead"):
        print(f"  {part}: {getattr(error, part)}")
    claim(all((error.asked, error.rule, error.evidence, error.instead)), "an error also says what to do instead")

# ---- Mistakes that Python would silently accept raise errors. ----
try:
    if x > 3:
        pass
    claim(False, "an expression was used as a condition")
except rg.CompileError as error:
    claim("select" in error.instead, "an expression has no truth value; the error suggests select()")
claim(isinstance(np.asarray(picture), np.ndarray), "numpy.asarray(buffer) is an array")
