"""Schedules of adjoints.

propagate_adjoints creates Funcs, so that compute_root, parallel, vectorize and compute_at work as for your own Funcs.
The compiler schedules those that have no directives. A schedule never changes the values.
"""
import time

import numpy as np
import retrograde as rg
from claims import claim

size = 512
x, y = rg.Var("x"), rg.Var("y")
j, i = np.indices((size + 1, size + 1))
image = rg.Buffer(((7 * i + i * j) % 29).astype("float32") / 16)
GUARD = rg.TailStrategy.GuardWithIf


def program():
    edges, soft, loss, pixels = rg.Func("edges"), rg.Func("soft"), rg.Func("loss"), rg.RDom([(0, size), (0, size)])
    edges[x, y] = image[x + 1, y] - image[x, y] + 0.5 * (image[x, y + 1] - image[x, y])
    soft[x, y] = edges[x, y] * edges[x, y] / (1 + edges[x, y] * edges[x, y])
    loss[()] = rg.f32(0)
    loss[()] += soft[pixels.x, pixels.y]
    return edges, loss


def milliseconds(f):
    result = np.zeros((size + 1, size + 1), "float32")
    f.realize(result)  # compiles
    begin = time.perf_counter()
    for n in range(5):
        f.realize(result)
    return 200 * (time.perf_counter() - begin), result


# ---- 1. The plainest schedule: everything at root, in serial loops. A directive on an adjoint turns off the compiler's
# own schedule. ----
edges, loss = program()
d = rg.propagate_adjoints(loss)
slow = d(image)
d(edges).compute_root()
slow.compute_root()
plain_ms, plain = milliseconds(slow)

# ---- 2. No directives: the compiler computes Funcs that are read several times and are not cheap at root, in parallel
# and vectorized. ----
edges, loss = program()
chosen_ms, chosen = milliseconds(rg.propagate_adjoints(loss)(image))
claim(np.abs(plain - chosen).max() < 1e-5, "the compiler's schedule changes no value")

# ---- 3. By hand: rows of the gradient in parallel and vectorized, and the adjoint of `edges` one strip at a time, just
# before it is needed. The gradient's dimensions have names like those of any Func. ----
edges, loss = program()
e = rg.propagate_adjoints(loss)
gradient, edges_adj = e(image), e(edges)
claim(len(gradient.args()) == 2, "the gradient by an image has the image's dimensions")
(gx, gy), rows = gradient.args(), rg.Var("rows")
gradient.compute_root().split(gy, rows, gy, 32, GUARD).parallel(rows).vectorize(gx, 8, GUARD)
edges_adj.compute_at(gradient, rows).vectorize(edges_adj.args()[0], 8, GUARD)
by_hand_ms, by_hand = milliseconds(gradient)
claim(np.abs(plain - by_hand).max() < 1e-5, "a schedule by hand changes no value either")

# ---- funcs() returns all generated Funcs in the order in which they are computed, for inspection or scheduling. ----
claim(len(e.funcs()) >= 3, "funcs() has the adjoints of soft, edges and the image")
print("plain %.2f ms, default %.2f ms, by hand %.2f ms" % (plain_ms, chosen_ms, by_hand_ms))
