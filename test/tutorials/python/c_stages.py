"""Extern stages: C functions through ctypes, with gradients.

A pipeline can call C functions on scalars in expressions, and C functions on buffers as stages. Here they are written in
Python and turned into C functions by ctypes; functions of a shared library work in the same way.
"""
import ctypes

import numpy as np
import retrograde as rg
from gradients.claims import claim
from retrograde import runtime

x, i = rg.Var("x"), rg.Var("i")

# ---- A function of the C library, in an expression. ----
f = rg.Func("f")
f[x] = rg.call_c_function("hypot", "float64", [rg.f64(x), rg.f64(4)])
claim(f.realize([4])[3] == 5, "hypot(3, 4) is 5")

# ---- A stage. It is called first to ask which region of its input it needs, and then to compute. ----
Image = ctypes.POINTER(runtime.halide_buffer_t)


def values(image):
    """A one-dimensional buffer as a NumPy array."""
    data = ctypes.cast(image.host, ctypes.POINTER(ctypes.c_float))
    return np.ctypeslib.as_array(data, (image.dim[0].extent,))


@ctypes.CFUNCTYPE(ctypes.c_int, Image, Image)
def cumulate(source, result):
    source, result = source[0], result[0]
    if not source.host:  # a bounds query: which region of the source is needed?
        source.dim[0].min, source.dim[0].extent = 0, result.dim[0].min + result.dim[0].extent
    else:
        values(result)[:] = np.cumsum(values(source))[result.dim[0].min:]
    return 0


CUMULATE = {"cumulate": rg.JITExtern(rg.ExternCFunction(cumulate, rg.ExternSignature("int32", [rg.Handle(), rg.Handle()])))}
n = 6
image, squares, running = rg.Buffer(np.arange(n, dtype="float32")), rg.Func("squares"), rg.Func("running")
squares[x] = image[x] * image[x]
squares.compute_root()
running.define_extern("cumulate", [squares], "float32", 1)
running.set_jit_externs(CUMULATE)
claim(np.asarray(running.realize([n])).tolist() == [0, 1, 5, 14, 30, 55], "running sums of squares")


# ---- Its gradient: the compiler cannot see inside the function, so a rule defines the adjoint. The adjoint of a running
# sum is a running sum from the end. ----
def rule(context):
    adjoint, rest = rg.Func("squares_adj"), rg.RDom([(0, n)])
    adjoint[i] = rg.f32(0)
    adjoint[i] += rg.select(rest >= i, context.adjoint()[rest], 0)
    return [(squares, adjoint)]


rg.custom_adjoint(running, [squares], rule, lambda argument, region: [(0, n)])
loss, r = rg.Func("loss"), rg.RDom([(0, n)])
loss[()] = rg.f32(0)
loss[()] += running[r]
gradient = rg.propagate_adjoints(loss)(image)
want = [2 * v * (n - v) for v in range(n)]
claim(np.asarray(gradient.realize([n])).tolist() == want, "the gradient counts each square in all sums that include it")
