"""User-defined derivatives.

A correct derivative may still be useless: the derivative of a step function is 0. custom_adjoint defines how adjoints
pass through a Func, whatever its definition is. straight_through covers the common case in one expression.
"""
import numpy as np
import retrograde as rg
from claims import claim

# A signal gets a gain and an offset and is stored in steps of a quarter. Which gain and offset bring the stored signal
# closest to `wanted`?
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


# ---- Without a rule the gradient is zero, and the reason is reported. ----
flat = rg.propagate_adjoints(loss)
claim(value_of(flat(gain)) == 0 and value_of(flat(offset)) == 0,
      "rounding has derivative 0, and so do its inputs")
told = any(fact.kind == rg.Explanation.Kind.Zero and "round" in fact.detail for fact in flat.explanations())
claim(told, "explanations() names round as the reason")


# ---- A rule: the adjoint of `stored` passes on to `scaled` unchanged, as if nothing had been rounded. A rule returns
# an adjoint, over the whole input, for each input that it covers. ----
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

# ---- The same without a separate Func: one expression's value with another's derivative. ----
inside, other = rg.Func("inside"), rg.Func("other")
inside[x] = rg.straight_through(rg.round(4 * scaled[x]) / 4, scaled[x])
other[()] = rg.f32(0)
other[()] += rg.pow(inside[r] - wanted[r], 2) / n
e = rg.propagate_adjoints(other)
claim(abs(value_of(e(gain)) - value_of(by_gain)) < 1e-5 and abs(value_of(e(offset)) - value_of(by_offset)) < 1e-5,
      "straight_through gives the same gradient")

# ---- Nothing is dropped silently: a requested gradient that the rule does not cover is an error. ----
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
claim("mixed" in refusal, "a requested input that the rule does not cover is an error")
