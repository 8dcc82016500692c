"""Parallel and vectorized reductions: rfactor splits an associative update into partial results."""
import numpy
import retrograde as rg

x, u, v = rg.Var("x"), rg.Var("u"), rg.Var("v")
j, i = numpy.indices((64, 96))
pixels = ((i * 7 + j * 11 + i * j) % 32).astype("uint8")
image = rg.Buffer(pixels)

# A histogram as written: one serial loop.
serial, r = rg.Func("serial"), rg.RDom(image)
serial[x] = 0
serial[image[r.x, r.y]] += 1
# The same histogram from one partial histogram per row, with all rows in parallel.
rows, s = rg.Func("rows"), rg.RDom(image)
rows[x] = 0
rows[image[s.x, s.y]] += 1
partial = rows.update().rfactor(s.y, v)
partial.compute_root().vectorize(x, 8).update().parallel(v)
a, b = numpy.asarray(serial.realize([256])), numpy.asarray(rows.realize([256]))
print(f"histogram: {(a != b).sum()} differences, sum {b.sum()}, {b[5]}")

# A sum over blocks of columns.
total, r, xo, xi = rg.Func("total"), rg.RDom([(0, 96), (0, 64)]), rg.RVar("xo"), rg.RVar("xi")
total[()] = 0
total[()] += rg.i32(image[r.x, r.y])
total.update().split(r.x, xo, xi, 8)
blocks = total.update().rfactor(xi, u)
blocks.compute_root().vectorize(u).update().vectorize(u)
print("sum:", total.realize()[()])

# Tuples work if all their values together are associative: here the darkest value and its position.
best, r = rg.Func("best"), rg.RDom([(0, 96), (0, 64)])
value = (r.x * 37 + r.y * 53) % 101 + rg.i32(image[r.x, r.y]) + 1
best[()] = (1000, 0)
best[()] = (rg.min(best[()][0], value), rg.select(best[()][0] < value, best[()][1], r.x + 96 * r.y))
rows = best.update().rfactor([(r.y, v)])
rows.compute_root().update().parallel(v)
darkest, place = (result[()] for result in best.realize())
px, py = place % 96, place // 96
print(f"darkest: {darkest}, there: {(px * 37 + py * 53) % 101 + int(pixels[py, px]) + 1}")

# Minimum and maximum over tiles.
extent, r = rg.Func("extent"), rg.RDom([(0, 96), (0, 64)])
xo, xi, yo, yi = (rg.RVar(name) for name in ("xo", "xi", "yo", "yi"))
extent[()] = (rg.u8(255), rg.u8(0))
extent[()] = (rg.min(extent[()][0], image[r.x, r.y]), rg.max(extent[()][1], image[r.x, r.y]))
extent.update().tile(r.x, r.y, xo, yo, xi, yi, 16, 16)
tiles = extent.update().rfactor([(xo, u), (yo, v)])
tiles.compute_root().update().parallel(v)
low, high = extent.realize()
print(f"from {low[()]} to {high[()]}")
