"""Generators: pipelines as classes, with params that a build file sets. With arguments (`generators_use.py -g local_mean
...`) this program compiles a generator to a library; without arguments it compiles three libraries and calls them."""
import enum
import subprocess
import sys
import tempfile

import numpy
import retrograde as rg
from retrograde import runtime

x, y = rg.Var("x"), rg.Var("y")


class Border(enum.Enum):
    repeat = "repeat"
    zero = "zero"


@rg.generator(name="local_mean")
class LocalMean:
    radius = rg.GeneratorParam(1, min=0, max=16)
    parallel = rg.GeneratorParam(True)
    border = rg.GeneratorParam(Border.repeat)
    accumulator = rg.GeneratorParam(rg.Int(32))
    input = rg.InputBuffer("uint8", 2)
    bias = rg.InputScalar("int32", 0, min=-64, max=64)
    output = rg.OutputBuffer("uint8", 2)

    def generate(self):
        if self.border == Border.repeat:
            source = rg.BoundaryConditions.repeat_edge(self.input)
        else:
            source = rg.BoundaryConditions.constant_exterior(self.input, 0)
        side = 2 * self.radius + 1
        r, total = rg.RDom([(-self.radius, side)] * 2), rg.Func("total")
        total[x, y] = rg.cast(self.accumulator, 0)
        total[x, y] += rg.cast(self.accumulator, source[x + r.x, y + r.y])
        self.output[x, y] = rg.u8(rg.clamp(rg.i32(total[x, y]) / (side * side) + self.bias, 0, 255))
        self.output.vectorize(x, self.natural_vector_size("uint8"))
        if self.parallel:
            self.output.parallel(y)
        lanes = self.natural_vector_size("float32")
        total.compute_at(self.output, y).vectorize(x, lanes).update().vectorize(x, lanes)


@rg.generator(name="blend")
class Blend:
    """Arrays of images, a Tuple, an output that is one value, and an input added by configure()."""

    extra = rg.GeneratorParam(0)
    images = rg.InputBuffer("float32", 1, count=1)
    weight = rg.InputScalar("float32", 0.5)
    blended = rg.OutputBuffer(["float32", "int32"], 1)
    largest = rg.OutputScalar("float32")

    def configure(self):
        for i in range(self.extra):
            self.add_input(f"extra_{i}", rg.InputBuffer("float32", 1))

    def generate(self):
        added = [getattr(self, f"extra_{i}") for i in range(self.extra)]
        total = rg.f32(0)
        for image in self.images:
            total += image[x] * self.weight
        for image in added:
            total += image[x]
        self.blended[x] = (total, len(self.images) + len(added))
        r = rg.RDom([(0, self.images[0].dim(0).extent())])
        self.largest[()] = -1e30
        self.largest[()] = rg.max(self.largest[()], self.images[0][r])


def library(folder, generator, name, *params):
    """Does the work of a build file: runs the program and links its output."""
    command = [sys.executable, "-B", __file__, "-g", generator, "-f", name, "-o", folder, "-e", "static_library",
               "target=host", *params]
    subprocess.run(command, check=True)
    rg.link_shared_library(f"{folder}/{name}.so", [f"{folder}/{name}.a"])
    return runtime.load(f"{folder}/{name}.so", name)


def use(folder):
    j, i = numpy.indices((48, 64))
    image = ((i * 9 + j * 7) % 200).astype("uint8")
    three, five = numpy.zeros_like(image), numpy.zeros_like(image)
    library(folder, "local_mean", "mean_3x3")(image, 10, three)
    print(f"3 x 3 returned 0: {three[0, 0]} {three[20, 30]} {three[47, 63]}")
    library(folder, "local_mean", "mean_5x5_zero", "radius=2", "border=zero", "parallel=false",
            "accumulator=uint16")(image, -5, five)
    print(f"5 x 5 returned 0: {five[0, 0]} {five[20, 30]} {five[47, 63]}")

    n = numpy.arange(10)
    a, b, c, total = (v.astype("float32") for v in (n * n % 7, n, 100 * n, 0 * n))
    count, largest = numpy.zeros(10, "int32"), numpy.zeros((), "float32")
    blend = library(folder, "blend", "blend", "images.size=2", "extra=1")
    names = [a.name for a in blend.arguments]
    blend(a, b, 0.25, c, total, count, largest)
    print("blend returned 0: %g %g, %d images, largest %g" % (total[3], total[9], count[0], largest))
    print("".join(f" {name}" for name in names))


if __name__ == "__main__":
    if len(sys.argv) > 2:
        rg.main()
    else:
        with tempfile.TemporaryDirectory() as made:
            use(made)
