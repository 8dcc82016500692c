"""Predicated reductions: reduction domains that are not boxes."""
import numpy
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")

# A disk.
disk, r = rg.Func("disk"), rg.RDom([(0, 9), (0, 7)])
r.where((r.x - 4) * (r.x - 4) + (r.y - 3) * (r.y - 3) <= 10)
disk[x, y] = 0
disk[r.x, r.y] = r.x + r.y
for line in numpy.asarray(disk.realize([9, 7])):
    print("".join("%3d" % value for value in line))

# A triangle: two conditions that must both hold.
triangle, r = rg.Func("triangle"), rg.RDom([(0, 8), (0, 8)])
r.where(r.x <= r.y)
r.where(r.y < 6)
triangle[x, y] = 0
triangle[r.x, r.y] += 1
print("triangle: %d points" % numpy.asarray(triangle.realize([8, 8])).sum())

# A condition that reads data.
j, i = numpy.indices((8, 16))
image = rg.Buffer(((i * 13 + j * 29) % 64).astype("uint8"))
bright, r = rg.Func("bright"), rg.RDom(image)
r.where(image[r.x, r.y] > 48)
bright[()] = (0, 0)
bright[()] = (bright[()][0] + 1, bright[()][1] + rg.i32(image[r.x, r.y]))
count, total = bright.realize()
print(f"{count[()]} bright pixels, sum {total[()]}")

# The condition may depend on pure variables, and the update can still be scheduled.
prefix, r, xo, xi = rg.Func("prefix"), rg.RDom([(0, 32)]), rg.Var("xo"), rg.Var("xi")
r.where(r < x * 3)
prefix[x] = 0
prefix[x] += r * r
prefix.update().split(x, xo, xi, 4).vectorize(xi).parallel(xo)
print("".join("%d " % value for value in prefix.realize([12])))
