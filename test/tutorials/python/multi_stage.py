"""Pipelines of several stages: compute and storage levels of producers, and how often each value is computed."""
import numpy
import retrograde as rg
from tracing import stores_told_to


def run(title, schedule):
    wave, edges, x, y = rg.Func("wave"), rg.Func("edges"), rg.Var("x"), rg.Var("y")
    wave[x, y] = (x * 7 + y * 3) % 11
    edges[x, y] = wave[x, y] + wave[x + 1, y] - wave[x, y + 1] - wave[x + 1, y + 1]
    schedule(wave, edges, x, y)
    wave.trace_stores()
    lanes = []
    edges.jit_handlers().custom_trace = stores_told_to(lambda event: lanes.append(event.type.lanes))
    result = numpy.asarray(edges.realize([16, 12]))
    j, i = numpy.indices(result.shape)
    print("%-22s wave stored %4d times, checksum %d" % (title, sum(lanes), (result * (i + 1) * (j + 2)).sum()))


xo, yo, xi, yi = (rg.Var(name) for name in ("xo", "yo", "xi", "yi"))
# Inlined into its consumer: never stored.
run("inline", lambda wave, edges, x, y: None)
# At root: all 17 x 13 points first.
run("root", lambda wave, edges, x, y: wave.compute_root())
# In each of the consumer's 12 rows: the two rows that it reads.
run("at y", lambda wave, edges, x, y: wave.compute_at(edges, y))
# Stored at root and computed per row: values of the previous row are still available (sliding window).
run("at y, stored at root", lambda wave, edges, x, y: wave.store_root().compute_at(edges, y))
run("at x", lambda wave, edges, x, y: wave.compute_at(edges, x))
run("at x, stored at y", lambda wave, edges, x, y: wave.store_at(edges, y).compute_at(edges, x))


# One tile at a time.
def tiled(wave, edges, x, y):
    edges.tile(x, y, xo, yo, xi, yi, 8, 4)
    wave.compute_at(edges, xo)


def tiled_and_vectorized(wave, edges, x, y):
    edges.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi, 4).parallel(yo)
    wave.compute_at(edges, xo)


run("tiled", tiled)
run("tiled and vectorized", tiled_and_vectorized)

# A blur whose input is clamped to the image, a NumPy array: a[y, x] is image[x, y].
j, i = numpy.indices((10, 20))
image = ((i * 31 + j * 17) % 255).astype("uint16")
x, y = rg.Var("x"), rg.Var("y")
clamped = rg.BoundaryConditions.repeat_edge(image)
blur_x, blur_y = rg.Func("blur_x"), rg.Func("blur_y")
blur_x[x, y] = (clamped[x - 1, y] + 2 * clamped[x, y] + clamped[x + 1, y]) / 4
blur_y[x, y] = (blur_x[x, y - 1] + 2 * blur_x[x, y] + blur_x[x, y + 1]) / 4
blur_x.compute_at(blur_y, y).vectorize(x, 8)
blur_y.vectorize(x, 8).parallel(y)
blurred = numpy.asarray(blur_y.realize([20, 10]))
print("blurred:", blurred[0, 0], blurred[0, 19], blurred[5, 10], blurred[9, 19])
