"""Operators of PyTorch that run pipelines, with their gradients.

    import retrograde as rg, torch
    from retrograde.torch import operator
    x, k, image, taps, blur = rg.Var("x"), rg.RDom([(0, 3)]), rg.ImageParam("float32", 1, "image"), \
        rg.ImageParam("float32", 1, "taps"), rg.Func("blur")
    blur[x] += image[x + k] * taps[k]
    op = operator("readme::blur", blur, [image, taps], lambda image, taps: [image.shape[0] - 2])
    weights = torch.ones(3, requires_grad=True)
    op(torch.rand(64), weights).sum().backward()          # weights.grad is there

Tensors may have any strides and are not copied. The axis rule of the package applies: t[y, x] == f[x, y]. On CUDA
tensors an operator runs as kernels on the current stream, with the schedule of auto_schedule() for the device. Leave
numbers on the CPU, because kernels take them as arguments.
The gradient pipeline for a set of inputs is built when it is first needed. Gradients are operators themselves, so they
can be differentiated again, any number of times. Their results are bit-identical from run to run.

An operator is registered through torch.library (_library.py), which gives it autograd in both modes, torch.compile,
vmap, autocast and torch.ops.ns.name. _plan.py runs the pipelines.
"""
from ._operator import Operator, operator
from ._plan import DTYPES

__all__ = ["DTYPES", "Operator", "operator"]
