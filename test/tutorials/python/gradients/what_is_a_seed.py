"""What is a seed?

A program with many outputs has a Jacobian J instead of a single gradient, with one row per output. Reverse mode
computes a weighted sum of the rows, w^T J. The seed is w, the weight of each output. A loss is the special case of one
output with weight 1.
"""
import numpy as np
import retrograde as rg
from claims import claim

n = 12
values = 1 + 0.25 * (np.arange(n, dtype="float32") * 5 % 7)
a, x, f = rg.Buffer(values), rg.Var("x"), rg.Func("f")
f[x] = a[x] * a[x + 1]  # outputs 0 ... 10 exist; d f(x) / d a(x) = a(x + 1)
outputs = n - 1

# ---- A seed that is 1 at one output and 0 elsewhere gives that output's row of J. ----
p, one = rg.Param("int32", "p"), rg.Func("one")
one[x] = rg.select(x == p, rg.f32(1), 0)
row = rg.propagate_adjoints(f, one, [(0, outputs)])(a)
matrix = np.array([row.realize([n], param_map={p: k}) for k in range(outputs)])
expected = np.zeros((outputs, n), "float32")
for k in range(outputs):
    expected[k, k], expected[k, k + 1] = values[k + 1], values[k]
claim((matrix == expected).all(), "a seed with a single 1 gives one row of J exactly")

# ---- Any other seed gives a weighted sum of the rows, in a single sweep. ----
weights = 0.5 - 0.125 * np.arange(outputs, dtype="float32")
swept = np.asarray(rg.propagate_adjoints(f, weights)(a).realize([n]))
claim(np.abs(weights @ matrix.astype("float64") - swept).max() < 1e-6, "a seed w gives w^T J")

# ---- For a loss, the seed is its derivative by each output. ----
loss, by_hand, r = rg.Func("loss"), rg.Func("by_hand"), rg.RDom([(0, outputs)])
loss[()] = rg.f32(0)
loss[()] += f[r] * f[r]
by_hand[x] = 2 * f[x]  # d loss / d f(x)
of_loss = np.asarray(rg.propagate_adjoints(loss)(a).realize([n]))
of_seed = np.asarray(rg.propagate_adjoints(f, by_hand, [(0, outputs)])(a).realize([n]))
claim(np.abs(of_loss - of_seed).max() < 1e-5, "the gradient of a loss is the sweep with seed d loss / d f")

# ---- The bounds select the outputs that count. Outside them the seed is not even read. ----
ones = rg.Func("ones")
ones[x] = rg.f32(1)
first = np.asarray(rg.propagate_adjoints(f, ones, [(0, 3)])(a).realize([n]))
claim(first[0] == values[1] and first[3] == values[2] and first[4] == 0,
      "outputs outside the bounds contribute nothing")
