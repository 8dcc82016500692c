"""Tuples: several values per point."""
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


class Fraction:
    """A fraction as a Tuple of two integers, with its own arithmetic."""

    def __init__(self, over, under):
        self.over, self.under = rg.Expr(over), rg.Expr(under)

    def __add__(self, other):
        return Fraction(self.over * other.under + other.over * self.under, self.under * other.under)

    def __lt__(self, other):
        return self.over * other.under < other.over * self.under

    def inverse(self):
        return Fraction(self.under, self.over)

    def values(self):
        return self.over, self.under


# One Buffer for each value.
both = rg.Func("both")
both[x, y] = (x + y, rg.sin(rg.f32(x * y)))
sums, sines = both.realize([4, 3])
print("2 buffers: %d %.4f" % (sums[3, 2], sines[3, 2]))

# Another definition can read a single value of the Tuple.
scaled = rg.Func("scaled")
scaled[x, y] = both[x, y][1] * both[x, y][0]
print("%.4f" % scaled.realize([4, 3])[2, 1])

# Results written to existing Buffers.
pair = rg.Func("pair")
pair[x] = (x * 2, rg.u8(x + 1))
first, second = rg.Buffer("int32", [5]), rg.Buffer("uint8", [5])
pair.realize([first, second])
print(f"{first[4]} {second[4]}, outputs {pair.outputs()}")

# The position of the largest value: by hand and with argmax.
source, largest = rg.Func("source"), rg.Func("largest")
source[x] = (x * 29) % 97
r = rg.RDom([(1, 63)])
largest[()] = (0, source[0])
better = source[r] > largest[()][1]
largest[()] = (rg.select(better, r, largest[()][0]), rg.select(better, source[r], largest[()][1]))
place, value = largest.realize()
named = rg.evaluate(rg.argmax(source[rg.RDom([(0, 64)])]))
print(f"largest: {value[()]} at {place[()]}, by name {named[1]} at {named[0]}")

# A user-defined type: the golden ratio by its continued fraction 1 + 1 / (1 + 1 / (1 + ...)).
convergent, later = rg.Func("convergent"), rg.RDom([(1, 11)])
convergent[x] = Fraction(1, 1).values()
before = Fraction(convergent[later - 1][0], convergent[later - 1][1])
convergent[later] = (before.inverse() + Fraction(1, 1)).values()
line = "".join("%d/%d " % point for point in zip(*convergent.realize([12])))

# The first convergent above 1.6 and below 1.62.
every = rg.RDom([(0, 12)])
candidate = Fraction(convergent[every][0], convergent[every][1])
is_near = (Fraction(8, 5) < candidate) & (candidate < Fraction(81, 50))
convergent.compute_root()
print(line + "- number %d" % rg.evaluate(rg.argmax(rg.i32(is_near))[0]))

# Euclid's algorithm: pairs (a, b) become (b, a % b) until b is 0. The program counts the steps.
pair, steps, step, later = rg.Func("pair"), rg.Func("steps"), rg.Var("step"), rg.RDom([(1, 7)])
pair[x, y, step] = (x + 1, y + 1)
a, b = pair[x, y, later - 1][0], pair[x, y, later - 1][1]
pair[x, y, later] = (rg.select(b == 0, a, b), rg.select(b == 0, 0, a % rg.max(b, 1)))
any_step = rg.RDom([(0, 8)])
steps[x, y] = rg.argmin(any_step, rg.i32(pair[x, y, any_step][1] != 0))[0]
pair.compute_root()
out = steps.realize([40, 16])
for j in range(16):
    print("".join(" .:+*#@%"[out[i, j]] for i in range(40)))
