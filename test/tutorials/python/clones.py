"""Func.clone_in: a copy of a producer for some of its consumers, so that it can be computed in two ways."""
import retrograde as rg
from tracing import stores_told_to

x, y = rg.Var("x"), rg.Var("y")

# f is inlined into h; its clone is computed at root for g.
f, g, h, both = (rg.Func(name) for name in ("f", "g", "h", "both"))
f[x, y] = x * 3 + y
g[x, y] = f[x, y] + f[x - 1, y] + f[x, y - 1]
h[x, y] = f[x, y] * f[x, y]
both[x, y] = g[x, y] + h[x, y]
copy = f.clone_in(g)
copy.compute_root().trace_stores()
g.compute_root()
lanes = []
both.jit_handlers().custom_trace = stores_told_to(lambda event: lanes.append(event.type.lanes))
out = both.realize([10, 7])
print(f"{sum(lanes)} stores into the copy, {out[0, 0]} {out[9, 6]}")

# A clone of a Func with an update, for several consumers.
f, a, b, c, total = (rg.Func(name) for name in ("f", "a", "b", "c", "sum"))
r = rg.RDom([(0, 5)])
f[x] = x
f[x] += r * x
a[x] = f[x] + 1
b[x] = f[x] + 2
c[x] = f[x] + 3
total[x] = a[x] + b[x] + c[x]
copy = f.clone_in([a, b])
f.compute_root()
copy.compute_root().trace_stores()
a.compute_root()
b.compute_root()
c.compute_root()
lanes.clear()
total.jit_handlers().custom_trace = stores_told_to(lambda event: lanes.append(event.type.lanes))
out = total.realize([6])
print(f"{sum(lanes)} stores into the copy:" + "".join(" %d" % value for value in out))
