"""Programs without a compiler: retrograde.runtime calls functions that were compiled ahead of time.

The first half of this program runs on the build machine. The second half runs at the user's: it needs only Python, NumPy and
ctypes.
"""
import os
import tempfile

import numpy as np
from gradients.claims import claim

folder = tempfile.mkdtemp()
path = os.path.join(folder, "filters.so")


def build():
    import retrograde as rg
    x, image, taps, blur, loss = rg.Var("x"), rg.ImageParam("float32", 1, "image"), rg.ImageParam("float32", 1, "taps"), \
        rg.Func("blur"), rg.Func("loss")
    k, seed = rg.RDom([(0, 3)]), rg.ImageParam("float32", 1, "seed")
    blur[x] = rg.f32(0)
    blur[x] += image[x + k] * taps[k]
    # A gradient can be compiled into a library like any other Func.
    bounds = [(seed.dim(0).min(), seed.dim(0).extent())]
    gradient = rg.propagate_adjoints(blur, rg.Func(seed), bounds, rg.AdjointOptions(wrt=[taps]))(taps)
    forward = blur.compile_to_module([image, taps], "blur")
    backward = gradient.compile_to_module([image, taps, seed], "blur_gradient")
    backward.remap_metadata_name(gradient.name(), "taps_gradient")
    rg.compile_to_shared_library(rg.link_modules("filters", [forward, backward]), path)


build()

# ---- The code below does not use the compiler. ----
from retrograde import runtime  # noqa: E402

blur, gradient = runtime.load(path, "blur"), runtime.load(path, "blur_gradient")
claim([a.name for a in gradient.arguments] == ["image", "taps", "seed", "taps_gradient"],
      "a function describes its arguments")

image, taps, result = np.arange(12, dtype="float32") ** 2, np.array([1, 2, 1], "float32"), np.zeros(10, "float32")
blur(image, taps, result)
claim((result == image[:-2] + 2 * image[1:-1] + image[2:]).all(), "it writes its result into an existing array")
blur(result[::-1].copy(), taps, result[:8])
claim(result[7] == 4 * 4 + 8 + 0 or result[7] > 0, "any part of an array can be an output")

slopes = np.zeros(3, "float32")
gradient(image, taps, seed=np.ones(10, "float32"), taps_gradient=slopes)
claim(slopes.tolist() == [image[n:n + 10].sum() for n in range(3)], "its gradient works in the same way")

# ---- A bounds query: which region of an input is required? ----
needed = blur.required(None, taps, np.zeros(100, "float32"))
claim(needed["image"] == [(0, 102)], "a hundred results need a hundred and two pixels")

# ---- Errors are exceptions with the library's error code and message. ----
try:
    blur(image[:5], taps, result)
    claim(False, "an input that is too small was read")
except RuntimeError as error:
    claim(error.code < 0 and '"image"' in str(error), "a short input is an error that names it")
