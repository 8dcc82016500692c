"""PyTorch operators: from a first pipeline to gradients, explanations, stored models and error messages.

operator() of retrograde.torch registers a pipeline with PyTorch. The operator takes and returns tensors without copies,
has gradients of every order, and works inside modules, torch.compile and torch.func. Axes are in reverse order, as for
arrays: t[y, x] == f[x, y].
"""
import copy
import io
import pickle
import sys

import retrograde as rg
from claims import claim

try:
    import torch
    from retrograde.torch import operator
except ModuleNotFoundError:
    print("skipped: there is no PyTorch")
    sys.exit(77)

# ---- A first operator: three taps over a signal. The last argument computes the sizes of the result. ----
x, k = rg.Var("x"), rg.RDom([(0, 3)], "k")
signal, taps, blur = rg.ImageParam("float32", 1, "signal"), rg.ImageParam("float32", 1, "taps"), rg.Func("blur")
blur[x] = 0.0
blur[x] += signal[x + k] * taps[k]
op = operator("tutorial::blur", blur, [signal, taps], lambda signal, taps: [signal.shape[0] - 2])
samples, weights = torch.rand(64), torch.tensor([0.25, 0.5, 0.25], requires_grad=True)
result = op(samples, weights)
expected = sum(samples[n:n + 62] * weights[n] for n in range(3))
claim(torch.allclose(result, expected), "the operator computes what the sum of three shifted signals is")
claim(torch.equal(torch.ops.tutorial.blur(samples, weights), result), "PyTorch knows it by its name")

# ---- Gradients: autograd calls the adjoint pipeline. Only what is asked for is compiled. ----
result.square().sum().backward()
reference, = torch.autograd.grad(expected.square().sum(), weights)
claim(torch.allclose(weights.grad, reference, rtol=1e-4), "the gradient is that of PyTorch's own operators")
claim(len(op.made()) == 1, "one derivative was compiled: nobody asked for the gradient of the samples")
batch = op(samples.expand(4, 64), weights.detach())
claim(batch.shape == (4, 62), "leading dimensions are a batch")

# ---- One definition for all types and sizes. It is compiled for the sizes that occur, which is faster. ----
y = rg.Var("y")


def smooth(kind, shapes):
    """Half of a pixel and an eighth of each neighbour. `shapes` is None where sizes are known in a call only."""
    image, inside, smoothed = rg.ImageParam(kind, 2, "image"), rg.Func("inside"), rg.Func("smoothed")
    height, width = shapes[0] if shapes else (image.dim(1).extent(), image.dim(0).extent())
    padded = rg.BoundaryConditions.repeat_edge(image, [(0, width), (0, height)])
    inside[x, y] = padded[x, y]
    around = inside[x - 1, y] + inside[x + 1, y] + inside[x, y - 1] + inside[x, y + 1]
    smoothed[x, y] = inside[x, y] / 2 + around / 8
    return smoothed, [image]


smoother = operator("tutorial::smooth", smooth)
image = torch.rand(12, 16, dtype=torch.float64, requires_grad=True)
claim(smoother(image).dtype == torch.float64, "the definition serves float64 too")
claim(torch.autograd.gradcheck(smoother, (image,), nondet_tol=0.0), "gradcheck passes, with equal bits in every run")

# ---- Several outputs are differentiated in one backward pass. Each may have sizes of its own. ----
angle, sine, cosine = rg.ImageParam("float32", 1, "angle"), rg.Func("sine"), rg.Func("cosine")
sine[x], cosine[x] = rg.sin(angle[x]), rg.cos(angle[x])
both = operator("tutorial::both", [sine, cosine], [angle])
turns = torch.rand(10, requires_grad=True)
s, c = both(turns)
(2 * s + 3 * c).sum().backward()
claim(torch.allclose(turns.grad, 2 * torch.cos(turns) - 3 * torch.sin(turns)), "the gradient of both outputs")
claim(len(both.made()) == 1, "one pipeline computes it")

# ---- What runs? explain() lists the stages, what bounds them, what is stored, and hints. ----
print(op.explain((100_000,), (3,)))
text = op.explain()
claim("signal: float32 [64]" in text, "without arguments it explains the last call")
claim('"blur"' in text and "bound by" in text, "each stage says what bounds it")
claim("backward, gradients of taps" in text, "the gradients that were asked for are explained too")

# ---- Schedules: an operator whose Funcs have no directives is scheduled automatically. Directives are kept. ----
scheduled = rg.Func("scheduled")
scheduled[x] = 0.0
scheduled[x] += signal[x + k] * taps[k]
scheduled.vectorize(x, 8)
scheduled.update().vectorize(x, 8)
by_hand = operator("tutorial::by_hand", scheduled, [signal, taps], lambda signal, taps: [signal.shape[0] - 2])
claim("vectors of 8 along x" in by_hand.explain((64,), (3,)), "explain() shows the directives at work")
claim(torch.equal(by_hand(samples, weights), op(samples, weights)), "a schedule does not change the result")


# ---- Models: an operator in a module is copied, stored and sent to workers with it. ----
class Blur(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.blur, self.weights = op, torch.nn.Parameter(torch.tensor([0.0, 1.0, 0.0]))

    def forward(self, samples):
        return self.blur(samples, self.weights)


model = Blur()
claim(torch.equal(copy.deepcopy(model)(samples), samples[1:-1]), "a copy of the model works")
claim(pickle.loads(pickle.dumps(op)) is op, "a pickle of a known operator is the operator")
file = io.BytesIO()
torch.save(model.state_dict(), file)
claim(b"tutorial::blur" not in file.getvalue(), "a state_dict holds weights only, as usual")

# ---- Errors say what was asked, which rule it breaks, what was given, and what to do instead. ----
try:
    op(samples.double(), weights)
except TypeError as problem:
    print(problem)
    claim("float64 [64]" in problem.evidence and "tensor.to(dtype)" in problem.instead, "a tensor of a wrong type")
try:
    op(samples, weights[:2])
except rg.RuntimeError as problem:
    print(problem)
    claim('"taps"' in str(problem), "a tensor that is too small: the message names it and the elements read")
count = rg.Func("count")
count[x] = 0
try:
    count[x] += signal[x + k]
except rg.CompileError as problem:
    print(problem)
    claim("0.0" in problem.instead, "a sum of floats starts from 0.0: a Func has the type of its first definition")
