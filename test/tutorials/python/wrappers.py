"""Func.in_: a wrapper between a producer and its consumers, with its own schedule."""
import numpy
import retrograde as rg
from tracing import stores_told_to

x, y, xo, yo, xi, yi = (rg.Var(name) for name in ("x", "y", "xo", "yo", "xi", "yi"))


def counting(f, lanes):
    f.jit_handlers().custom_trace = stores_told_to(lambda event: lanes.append(event.type.lanes))


def checksum(image):
    a = numpy.asarray(image)
    j, i = numpy.indices(a.shape)
    return (a * (1 + i + 3 * j)).sum()


# One consumer reads the wrapper; the other reads f.
f, g, h, both = (rg.Func(name) for name in ("f", "g", "h", "both"))
f[x, y] = x * y + x
g[x, y] = f[x, y] + f[x + 1, y]
h[x, y] = f[x, y] * 2
both[x, y] = g[x, y] - h[x, y]
wrapper = f.in_(g)
f.compute_root()
g.compute_root()
h.compute_root()
wrapper.compute_at(g, y).trace_stores()
lanes = []
counting(both, lanes)
out = both.realize([8, 6])
print(f"one consumer: {sum(lanes)} stores into the wrapper, checksum {checksum(out)}")
print("a second call gives the same wrapper: %d" % f.in_(g).same_as(wrapper))

# All consumers.
f, g, h, both = (rg.Func(name) for name in ("f", "g", "h", "both"))
f[x, y] = x + 5 * y
g[x, y] = f[x, y] + 1
h[x, y] = f[x, y] + 2
both[x, y] = g[x, y] * h[x, y]
f.in_().compute_root().trace_stores()
f.compute_root()
g.compute_root()
h.compute_root()
lanes = []
counting(both, lanes)
out = both.realize([8, 6])
print(f"all consumers: {sum(lanes)} stores into the wrapper, checksum {checksum(out)}")

# Staging: each tile of the input is copied to local storage before it is used.
j, i = numpy.indices((30, 40))
image = rg.ImageParam("int32", 2, "input")
image.set(((i * 3 + j * 5) % 17).astype("int32"))
clamped, blur = rg.Func("clamped"), rg.Func("blur")
clamped[x, y] = image[rg.clamp(x, 0, 39), rg.clamp(y, 0, 29)]
blur[x, y] = clamped[x - 1, y] + clamped[x + 1, y] + clamped[x, y - 1] + clamped[x, y + 1]
blur.tile(x, y, xo, yo, xi, yi, 16, 8)
clamped.in_(blur).compute_at(blur, xo).vectorize(x, 4)
print("staged tiles: checksum", checksum(blur.realize([40, 30])))

# A wrapper of the output: the reduction stays in registers and is stored once.
product, k = rg.Func("product"), rg.RDom([(0, 12)])
product[x, y] = 0
product[x, y] += (x + k) * (k - y)
product.in_().tile(x, y, xi, yi, 8, 4)
product.compute_at(product.in_(), x)
print("output wrapper: checksum", checksum(product.in_().realize([16, 12])))
