"""Loop directives: the effect of each on the order of stores, recorded by a trace."""
import numpy
import retrograde as rg
from tracing import stores_told_to

stored = []


def record(event):
    lanes = event.type.lanes
    stored.extend((event.coordinates[lane], event.coordinates[lanes + lane]) for lane in range(lanes))


def show(title, schedule):
    f, x, y = rg.Func("f"), rg.Var("x"), rg.Var("y")
    f[x, y] = x + y
    schedule(f, x, y)
    f.trace_stores()
    f.jit_handlers().custom_trace = stores_told_to(record)
    stored.clear()
    result = f.realize([6, 4])
    print("%-10s" % title + "".join(" %d%d" % point for point in stored[:14]) + f"  ({len(stored)} stores)")
    for y in range(4):
        for x in range(6):
            if result[x, y] != x + y:
                print("wrong at", x, y)


xo, yo, xi, yi, both, tile = (rg.Var(name) for name in ("xo", "yo", "xi", "yi", "both", "tile"))
show("default", lambda f, x, y: None)
show("reorder", lambda f, x, y: f.reorder(y, x))
show("split", lambda f, x, y: f.split(x, xo, xi, 3))
show("fuse", lambda f, x, y: f.fuse(x, y, both))
show("tile", lambda f, x, y: f.tile(x, y, xo, yo, xi, yi, 3, 2))
show("vectorize", lambda f, x, y: f.split(x, xo, xi, 2).vectorize(xi))
show("unroll", lambda f, x, y: f.split(x, xo, xi, 2).unroll(xi))
show("columns", lambda f, x, y: f.split(y, yo, yi, 2).reorder(yi, x, yo))
# 4 does not divide 6: the last block shifts inwards and recomputes two points.
show("inwards", lambda f, x, y: f.split(x, xo, xi, 4))
show("guarded", lambda f, x, y: f.split(x, xo, xi, 4, rg.TailStrategy.GuardWithIf))
show("nested", lambda f, x, y: f.tile(x, y, xo, yo, xi, yi, 2, 2).fuse(xo, yo, tile).unroll(yi))

# The order of a parallel loop is unspecified, so only the result is shown.
g, x, y = rg.Func("g"), rg.Var("x"), rg.Var("y")
g[x, y] = x * 100 + y
g.tile(x, y, xo, yo, xi, yi, 16, 8).fuse(xo, yo, tile).parallel(tile).vectorize(xi, 4)
print("parallel: sum", numpy.asarray(g.realize([61, 35])).sum())
