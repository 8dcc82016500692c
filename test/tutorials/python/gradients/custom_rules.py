"""Rules of your own.

A derivative that is right may still be of no use: that of a step is 0. custom_adjoint says how adjoints pass a Func,
whatever its definition is; straight_through does the common case in one expression.
"""
import numpy as np
import retrograde as rg
from claims import claim

# A signal that is stored with levels of a quarter, after a gain. Which gain and offset come closest to what is wanted
# after storing?
n = 32
values = np.sin(np.float32(0.4) * np.arange(n, dtype="float32"))
signal, wanted = rg.Buffer(values), rg.Buffer(np.round(4 * (1.7 * values + 0.6)) / 4)
gain, offset = rg.Param("float32", "gain", 1.0), rg.Param("float32", "offset", 0.0)
x, i, r = rg.Var("x"), rg.Var("i"), rg.RDom([(0, n)])
scaled, stored, loss = rg.Func("scaled"), rg.Func("stored"), rg.Func("loss")
scaled[x] = gain * signal[x] + offset
stored[x] = rg.round(4 * scaled[x]) / 4
loss[()] = rg.f32(0)
loss[()] += rg.pow(stored[r] - wanted[r], 2) / n


def value_of(f):
    return f.realize()[()]


# ---- Without a rule: zero, and the reason is told. ----
flat = rg.propagate_adjoints(loss)
claim(value_of(flat(gain)) == 0 and value_of(flat(offset)) == 0,
      "rounding has the derivative 0, and so has all before it")
told = any(fact.kind == rg.Explanation.Kind.Zero and "round" in fact.detail for fact in flat.explanations())
claim(told, "explanations() says that it is round that stops the gradient")


# ---- A rule: what reaches `stored` passes on to `scaled` as if nothing had been rounded. A rule gives an adjoint, over the
# whole input, for each input that it is made for. ----
def pass_on(context):
    passed = rg.Func("passed")
    passed[i] = context.adjoint()[i]
    return [(scaled, passed)]


rg.custom_adjoint(stored, [scaled], pass_on)
d = rg.propagate_adjoints(loss)
by_gain, by_offset = d(gain), d(offset)
losses = []
for step in range(40):
    losses.append(value_of(loss))
    down_gain, down_offset = 0.3 * value_of(by_gain), 0.3 * value_of(by_offset)
    gain.set(gain.get() - down_gain)
    offset.set(offset.get() - down_offset)
claim(losses[-1] < 0.1 * losses[0], "with the rule, gain and offset are learned through the rounding")

# ---- The same without a Func of its own: one value with another's derivative. ----
inside, other = rg.Func("inside"), rg.Func("other")
inside[x] = rg.straight_through(rg.round(4 * scaled[x]) / 4, scaled[x])
other[()] = rg.f32(0)
other[()] += rg.pow(inside[r] - wanted[r], 2) / n
e = rg.propagate_adjoints(other)
claim(abs(value_of(e(gain)) - value_of(by_gain)) < 1e-5 and abs(value_of(e(offset)) - value_of(by_offset)) < 1e-5,
      "straight_through gives the same gradient")

# ---- Nothing is dropped: what a rule does not speak of, and somebody asks for, is an error. ----
mixed, total = rg.Func("mixed"), rg.Func("sum")
mixed[x] = scaled[x] * wanted[x]
total[()] = rg.f32(0)
total[()] += mixed[r]
rg.custom_adjoint(mixed, [scaled], pass_on)
refusal = ""
try:
    rg.propagate_adjoints(total, rg.AdjointOptions(wrt=[wanted]))
except rg.CompileError as error:
    refusal = str(error)
claim("mixed" in refusal, "an input that a rule forgets is an error")
