"""Checking and explaining gradients.

check_gradients compares adjoints with finite differences, the complex step and tangents, in double. explanations()
reports how each adjoint is computed, what is stored, and why a gradient is zero.
"""
import numpy as np
import retrograde as rg
from claims import claim

n = 24
k = np.arange(n)
a = rg.Buffer(0.5 + (k * 5 % 11 / 16).astype("float32"), "a")
table = rg.Buffer(1 + 0.125 * np.arange(8, dtype="float32"), "table")
places = rg.Buffer((k * 3 % 8).astype("int32"), "places")
x, i, r = rg.Var("x"), rg.Var("i"), rg.RDom([(0, n - 1)])
looked_up, model, loss = rg.Func("looked_up"), rg.Func("model"), rg.Func("loss")
looked_up[x] = table[rg.clamp(places[x], 0, 7)]
model[x] = rg.tanh(a[x] * a[x + 1]) * looked_up[x] + rg.floor(8 * a[x]) / 8
loss[()] = rg.f32(0)
loss[()] += rg.pow(model[r], 2)

# ---- Is it right? Finite differences fail at steps, so the step function is left out of the check. ----
smooth, smooth_loss = rg.Func("smooth"), rg.Func("smooth_loss")
smooth[x] = rg.tanh(a[x] * a[x + 1]) * looked_up[x]
smooth_loss[()] = rg.f32(0)
smooth_loss[()] += rg.pow(smooth[r], 2)
report = rg.check_gradients(smooth_loss)
claim(report.worst_error < 1e-8, "adjoints in double agree with differences to eight digits")
for given in report.inputs:
    claim(given.dot_product_error < 1e-12, "and with tangents to twelve digits: " + given.name)
claim(not report.complex_step_refused, "the complex step, exact up to rounding, was possible")
for given in report.inputs:
    claim(given.own_precision_error < 1e-4, "in float32, as the program runs, four digits are correct")


# ---- Would an error be noticed? This rule omits a factor of two. ----
def half(context):
    adjoint = rg.Func("half")
    adjoint[i] = context.adjoint()[i] * a[i]  # should be 2 a(i)
    return [(a, adjoint)]


wrong, wrong_loss = rg.Func("wrong"), rg.Func("wrong_loss")
wrong[x] = a[x] * a[x]
rg.custom_adjoint(wrong, [a], half)
wrong_loss[()] = rg.f32(0)
wrong_loss[()] += wrong[r]
quick = rg.GradientCheckOptions(directions=1)
claim(rg.check_gradients(wrong_loss, [], quick).worst_error > 0.1, "check_gradients finds the wrong rule")

# ---- Explanations of the gradient. ----
d = rg.propagate_adjoints(loss)
print(f"\nIn short:\n{d.explain()}")
print(f"Fact by fact:\n{d.explain(rg.Detail.All)}")


def says(kind, subject):
    return any(fact.kind == kind and subject in fact.subject for fact in d.explanations())


claim(says(rg.Explanation.Kind.Built, a.name()), "built: the gradient by a is a gather")
claim(says(rg.Explanation.Kind.Scattered, table.name()),
      "scattered: the table is read at data-dependent indices, so its gradient is a scatter")
by_places = rg.propagate_adjoints(loss)
by_places(places)  # integers have no derivative; requested on purpose
claim(any(fact.kind == rg.Explanation.Kind.Zero for fact in by_places.explanations()),
      "zero: the gradient by integers is zero, and the reason is reported")

# ---- The cost of the gradient. ----
claim(d.operations().ratio() < 6, "the whole gradient takes at most six times the operations of the program")
