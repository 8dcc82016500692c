"""What a notebook shows, and what the package says of itself: loops, pictures, signatures, messages."""
import numpy as np
import retrograde as rg
from gradients.claims import claim

x, y = rg.Var("x"), rg.Var("y")

# ---- A Func shows the loops of its schedule. ----
f = rg.Func("f")
f[x, y] = x ^ y
f.vectorize(x, 8).parallel(y)
shown = f._repr_html_()  # what a notebook asks for
claim("parallel" in shown and "vectorized" in shown, "the cell of a Func shows its loops")

# ---- A Buffer shows its picture: a PNG. ----
picture = f.realize([256, 256])
claim(picture._repr_png_().startswith(b"\x89PNG"), "the cell of a Buffer shows its picture")

# ---- repr() says what a thing is. ----
claim(repr(f) == f"<retrograde.Func {f.name()}(x, y) of int32>", repr(f))
claim("[0, 256)" in repr(picture), repr(picture))
claim(str(rg.clamp(x, 0, 9) * 2) != "", f"an expression is its text: {rg.clamp(x, 0, 9) * 2}")

# ---- help(rg.Func.tile) is what the headers say, with the loops before and after. ----
claim("=>" in rg.Func.compute_root.__doc__, "the docstring of a directive shows what it does to loops")

# ---- Errors are exceptions; their four parts are attributes. ----
try:
    f.unroll(rg.Var("z"))
    claim(False, "a loop that is not there was unrolled")
except rg.CompileError as error:
    for part in ("asked", "rule", "evidence", "instead"):
        print(f"  {part}: {getattr(error, part)}")
    claim(all((error.asked, error.rule, error.evidence, error.instead)), "an error says what to do instead")

# ---- What would be a silent mistake is a loud one. ----
try:
    if x > 3:
        pass
    claim(False, "an expression was true")
except rg.CompileError as error:
    claim("select" in error.instead, "an expression is neither true nor false: write select()")
claim(isinstance(np.asarray(picture), np.ndarray), "and an array is one call away")
