"""Debugging a pipeline: print, print_when, traces of stores, loop nests, lowered statements."""
import sys
from pathlib import Path

import retrograde as rg

folder = sys.argv[1] if len(sys.argv) > 1 else "."
x, y = rg.Var("x"), rg.Var("y")

# print() returns its first argument, and prints all arguments each time it is evaluated.
squares = rg.Func("squares")
squares[x] = rg.print(x * x, "is the square of", x)
squares.realize([4])

# print_when() prints only where a condition holds.
product = rg.Func("product")
product[x, y] = rg.print_when((x == 3) & (y > 1), x * y, "<- product at", x, y)
product.realize([5, 4])

# print() of other types.
mixed = rg.Func("mixed")
mixed[x] = rg.print(rg.f32(x) / 4, rg.u8(x + 250), rg.f64(x) / 8, x == 2)
mixed.realize([3])

# A trace reports every stored value.
traced = rg.Func("traced")
traced[x, y] = x + 10 * y
traced.trace_stores()
traced.realize([3, 2])

# The loops of a schedule, without running them.
producer, consumer = rg.Func("producer"), rg.Func("consumer")
producer[x, y] = x * y
consumer[x, y] = producer[x, y] + producer[x + 1, y]
consumer.reorder(y, x).parallel(x)
producer.compute_root().parallel(y)
consumer.print_loop_nest()

# The loops after splits and compute_at.
rows, stencil, xo, xi = rg.Func("rows"), rg.Func("stencil"), rg.Var("xo"), rg.Var("xi")
rows[x, y] = x - y
stencil[x, y] = rows[x, y] + rows[x + 1, y]
stencil.split(x, xo, xi, 4).vectorize(xi).unroll(y, 2)
rows.compute_at(stencil, xo).vectorize(x, 4)
stencil.print_loop_nest()

# The lowered statement, just before code generation, as text and as HTML.
lowered = rg.Func("lowered")
lowered[x, y] = x + y
lowered.vectorize(x, 8).parallel(y)
lowered.compile_to_lowered_stmt(folder + "/lowered.stmt", [], rg.StmtOutputFormat.Text)
lowered.compile_to_lowered_stmt(folder + "/lowered.html", [], rg.StmtOutputFormat.HTML)
for name in ("lowered.stmt", "lowered.html"):
    contents = Path(folder, name).read_text()
    print("%s: names the Func: %d, and its parallel loop: %d" % (name, "lowered" in contents, "parallel" in contents))

# An expression can be inspected without running it.
e = (x + 3) * y
print("its type has", e.type().bits(), "bits")
