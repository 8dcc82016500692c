"""Update definitions: reduction domains, histograms, scans, inline reductions."""
import numpy
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


def show(title, values):
    print("%-12s" % title + "".join(" %g" % v for v in numpy.asarray(values)))


# Update definitions change points of earlier definitions.
f = rg.Func("f")
f[x] = x
f[3] = 100
f[x] = f[x] + 5
f[x] *= 2
show("points", f.realize([6]))
print(f.num_update_definitions(), "updates")

# A reduction domain is a loop, here over powers of two.
powers, r = rg.Func("powers"), rg.RDom([(1, 9)])
powers[x] = 1
powers[r] = powers[r - 1] * 2
show("powers", powers.realize([10]))

# A scatter (a histogram) and a scan (its running sum).
j, i = numpy.indices((30, 40))
image = rg.Buffer(((i * j + i) % 8).astype("uint8"))
histogram, cumulative, pixels = rg.Func("histogram"), rg.Func("cumulative"), rg.RDom(image)
histogram[x] = 0
histogram[rg.clamp(image[pixels.x, pixels.y], 0, 7)] += 1
i = rg.RDom([(1, 7)])
cumulative[x] = histogram[x]
cumulative[i] = cumulative[i - 1] + histogram[i]
histogram.compute_root()
show("histogram", histogram.realize([8]))
show("cumulative", cumulative.realize([8]))

# A two-dimensional reduction, with a schedule for the update only.
table, r, yo, yi = rg.Func("table"), rg.RDom([(0, 4), (0, 3)]), rg.Var("yo"), rg.Var("yi")
table[x, y] = 0
table[x, y] += (x + r.x) * (y + r.y)
table.update().split(y, yo, yi, 2).parallel(yo).vectorize(x, 4)
out = table.realize([8, 6])
print("table       ", out[0, 0], out[7, 0], out[7, 5])

# Inline reductions: sums and extrema inside an expression.
source, stats, r = rg.Func("source"), rg.Func("stats"), rg.RDom([(0, 16)])
source[x] = (x * 37) % 16
stats[x] = rg.select(x == 0, rg.sum(source[r]), x == 1, rg.maximum(source[r]), x == 2, rg.minimum(source[r]),
                     rg.product(source[1 + r % 3]))
show("stats", stats.realize([4]))

# Exponential smoothing is a scan along rows; rows are independent and run in parallel.
smooth, r = rg.Func("smooth"), rg.RDom([(1, 7)])
smooth[x, y] = rg.f32((x * 5 + y) % 4)
smooth[r, y] = smooth[r - 1, y] * 0.5 + smooth[r, y] * 0.5
smooth.update().parallel(y)
out = smooth.realize([8, 3])
print("smooth       %g %g %g" % (out[7, 0], out[7, 1], out[7, 2]))
