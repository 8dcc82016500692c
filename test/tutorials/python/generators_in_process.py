"""Generators used in the same program: created, configured, given inputs, run."""
import numpy
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


@rg.generator(name="scale")
class Scale:
    factor = rg.GeneratorParam(2)
    input = rg.InputBuffer("int32", 2)
    output = rg.OutputBuffer("int32", 2)

    def generate(self):
        self.output[x, y] = self.input[x, y] * self.factor
        self.output.compute_root().vectorize(x, self.natural_vector_size("int32"), rg.TailStrategy.GuardWithIf)


@rg.generator(name="threshold")
class Threshold:
    input = rg.InputBuffer("int32", 2)
    limit = rg.InputScalar("int32")
    output = rg.OutputBuffer("uint8", 2)

    def generate(self):
        self.output[x, y] = rg.select(self.input[x, y] > self.limit, rg.u8(255), 0)


source = rg.Func("source")
source[x, y] = x + y * 3

# One generator reads the result of another.
scaled = Scale.call(source, generator_params={"factor": 5}).realize([8, 4])
print("scaled:", scaled[1, 0], scaled[7, 3])
for row in numpy.asarray(Threshold.call(scaled, 30).realize([8, 4])):
    print("".join("%4d" % value for value in row))

# The output of a generator is a Func that other Funcs can read.
combined = rg.Func("combined")
combined[x, y] = Scale.call(source)[x, y] + source[x, y]
print("combined:", combined.realize([8, 4])[7, 3])
