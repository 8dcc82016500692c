"""Forward mode and Hessians.

propagate_tangents answers the question that reverse mode does not: if the inputs move in this direction, how do all
values move? The tangent of a gradient is a product with the Hessian, and a few such products give the whole Hessian.
"""
import numpy as np
import retrograde as rg
from claims import claim

# Fits a smooth line to noisy points; a fourth-order term penalises large values.
n = 32
k = np.arange(n, dtype="float32")
line_values, v = np.zeros(n, "float32"), k * 11 % 7 / 4 - 0.75
line, points = rg.Buffer(line_values), rg.Buffer(np.sin(np.float32(0.3) * k) + k * 7 % 5 / 8)
loss, every, pairs = rg.Func("loss"), rg.RDom([(0, n)]), rg.RDom([(0, n - 1)])
loss[()] = rg.f32(0)
loss[()] += 0.5 * rg.pow(line[every] - points[every], 2) + 0.25 * rg.pow(line[every], 4)
loss[()] += 4 * rg.pow(line[pairs + 1] - line[pairs], 2)


def values(func, *sizes):
    return np.asarray(func.realize(list(sizes) or [n])).astype("float64")


# ---- Forward and reverse mode see the same matrix from two sides: <J v, w> = <v, J^T w>. ----
gradient = rg.propagate_adjoints(loss)(line)
slope = rg.propagate_tangents(loss, [(line, v)])(loss).realize()[()]
claim(abs(slope - values(gradient) @ v) < 1e-3, "the tangent along v is the gradient times v")

# ---- The tangent of the gradient is H v. H itself is never formed. ----
product = values(rg.hessian_vector_product(loss, line, [(line, v)]))
h = 1 / 256
here = values(gradient)
line_values += np.float32(h) * v
there = values(gradient)
line_values -= np.float32(h) * v
claim(np.abs((there - here) / h - product).max() < 0.05, "a finite difference of gradients is close to H v")

# ---- The whole Hessian: columns that share no row share a product. ----
matrix = rg.hessian(loss, line)
claim(matrix.colours() == 3, "only neighbours interact: three products suffice for any length")
claim(np.abs(values(matrix.dense(), n, n) @ v - product).max() < 1e-3, "its product with v is H v")

# ---- An application: Newton's method compared with gradient descent. ----
dense = matrix.dense()
downhill, newton = [], []
for step in range(12):
    downhill.append(np.log10(np.linalg.norm(values(gradient))))
    line_values -= (0.05 * values(gradient)).astype("float32")
line_values[:] = 0
for step in range(12):
    newton.append(np.log10(np.linalg.norm(values(gradient))))
    line_values -= np.linalg.solve(values(dense, n, n), values(gradient)).astype("float32")
claim(newton[6] < -4, "six Newton steps bring the gradient below 1e-4")
claim(downhill[11] > -2, "twelve steps of gradient descent do not bring it below 1e-2")
