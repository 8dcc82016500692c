"""Operators of PyTorch made of pipelines, with their gradients.

    import retrograde as rg, torch
    from retrograde.torch import operator
    x, k, image, taps, blur = rg.Var("x"), rg.RDom([(0, 3)]), rg.ImageParam("float32", 1, "image"), \
        rg.ImageParam("float32", 1, "taps"), rg.Func("blur")
    blur[x] += image[x + k] * taps[k]
    op = operator("readme::blur", blur, [image, taps], lambda image, taps: [image.shape[0] - 2])
    weights = torch.ones(3, requires_grad=True)
    op(torch.rand(64), weights).sum().backward()          # weights.grad is there

Tensors have any strides and are not copied; the axis rule is the package's: t[y, x] == f[x, y]. Those of CUDA run as
kernels on the stream that is current, with the schedule that auto_schedule() gives for the device; numbers are best
left on the CPU, for kernels take them as arguments.
Gradients are pipelines, made when they are first asked for, of exactly those inputs that want one; they are operators
themselves, so that they are differentiated again, as often as one likes. Their bits are the same from run to run.

An operator is registered through torch.library (_library.py), so that PyTorch knows what it does: autograd in both
modes, torch.compile, vmap, autocast, torch.ops.ns.name. _plan.py is what runs.
"""
from ._operator import Operator, operator
from ._plan import DTYPES

__all__ = ["DTYPES", "Operator", "operator"]
