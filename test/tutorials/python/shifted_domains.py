"""Regions that do not start at the origin."""
import retrograde as rg

distance, x, y = rg.Func("distance"), rg.Var("x"), rg.Var("y")
distance[x, y] = rg.abs(x) + rg.abs(y)

# A Buffer has a min in each dimension; realize() computes the region that the Buffer covers.
around = rg.Buffer("uint32", [7, 5])
around.set_min([-3, -2])
distance.realize(around)
for j in range(around.top(), around.bottom() + 1):
    print("".join("%3d" % around[i, j] for i in range(around.left(), around.right() + 1)))

# Translating a Buffer renames its coordinates and moves no data.
elsewhere = rg.Buffer("uint32", [4, 3])
elsewhere.set_min([100, 50])
distance.realize(elsewhere)
print("dim 0 is [%d, %d], at its corner %d"
      % (elsewhere.dim(0).min(), elsewhere.dim(0).max(), elsewhere[100, 50]))
elsewhere.translate(0, -100)
elsewhere.translate([0, -50])
print("moved: dim 0 is [%d, %d], at its corner %d" % (elsewhere.dim(0).min(), elsewhere.dim(0).max(), elsewhere[0, 0]))

# An input can be read at any coordinate that it covers.
samples = rg.Buffer("uint8", [10])
samples.set_min([-4])
for i in range(-4, 6):
    samples[i] = i + 4
mirrored = rg.Func("mirrored")
mirrored[x] = samples[-x]
window = rg.Buffer("uint8", [9])
window.set_min([-4])
mirrored.realize(window)
print("".join("%d " % window[i] for i in range(-4, 5)))

# Bounds inference: the required region of an input follows from the region of the output.
image, shifted = rg.ImageParam("uint8", 2, "input"), rg.Func("shifted")
shifted[x, y] = image[x - 2, y + 3] + image[x + 1, y]
shifted.infer_input_bounds([10, 20])
needed = image.get()
print("needs [%d, %d] x [%d, %d]" % (needed.left(), needed.right(), needed.top(), needed.bottom()))
