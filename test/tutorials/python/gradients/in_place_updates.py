"""In-place updates.

An update may overwrite a value that its own derivative needs. Reverse mode then stores versions of the value, within a
budget that you can set, and reports this. You can also forbid it; the error message then says how to rewrite the
program.
"""
import numpy as np
import retrograde as rg
from claims import claim

n = 8
values = 0.75 + 0.125 * np.arange(n, dtype="float32")
values[3] = 0
a, r = rg.Buffer(values), rg.RDom([(0, n)])

# ---- A sum needs none of its overwritten values: the derivative of f + a by a is 1 for every f. ----
total = rg.Func("total")
total[()] = rg.f32(0)
total[()] += a[r]
refuse = rg.AdjointOptions(overwritten=rg.Overwritten.Refuse)
ones = np.asarray(rg.propagate_adjoints(total, refuse)(a).realize([n]))
claim((ones == 1).all(), "a sum needs no versions, so Overwritten::Refuse accepts it")


# ---- A product does: the derivative by a factor is the product of the other factors, which includes earlier values of
# f. ----
def product_of(name):
    product = rg.Func(name)
    product[()] = rg.f32(1)
    product[()] *= a[r]
    return product


of_product = rg.propagate_adjoints(product_of("product"))
slopes = np.asarray(of_product(a).realize([n]))
others = np.array([np.delete(values.astype("float64"), k).prod() for k in range(n)])
claim(np.abs(slopes - others).max() < 1e-6,
      "the gradient is correct even where a factor is 0: nothing is divided by it")
kept = any(fact.kind == rg.Explanation.Kind.Version for fact in of_product.explanations())
claim(kept, "explanations() reports the stored versions")


# ---- Limits on memory: the error names the Func and the remedy. ----
def refusal(options):
    try:
        rg.propagate_adjoints(product_of("forbidden"), options)
    except rg.CompileError as error:
        return error
    return None


never, budget = refusal(refuse), refusal(rg.AdjointOptions(version_bytes=16))  # 8 steps of 4 bytes need more
print(f"\nasked: {never.asked}\ninstead: {never.instead}\n\nevidence: {budget.evidence}\n")
claim("forbidden" in str(never), "Overwritten::Refuse names the Func")
claim("16" in str(budget), "a budget that is too small is an error that states its bytes")

# ---- If a dimension of your own holds the versions, nothing is overwritten. ----
i, steps, last = rg.Var("i"), rg.Func("steps"), rg.Func("last")
steps[i] = rg.f32(1)
steps[r + 1] = steps[r] * a[r]
last[()] = steps[n]
same = np.asarray(rg.propagate_adjoints(last, refuse)(a).realize([n]))
claim(np.abs(same - slopes).max() < 1e-6, "a Func with its steps along a dimension has the same gradient")
