"""Modules of PyTorch that hold operators, and operators' definitions, for torch_pickling_test.py and the processes that it
begins."""
import sys

import torch

import retrograde as rg


class Held(torch.nn.Module):
    """weight * operator(image)."""

    def __init__(self, operator):
        super().__init__()
        self.operator, self.weight = operator, torch.nn.Parameter(torch.full((), 2.0))

    def forward(self, *tensors):
        return self.weight * self.operator(*tensors)


def scaled(kind):
    """The definition of an operator."""
    image, scale, f, x = rg.ImageParam(kind, 1, "image"), rg.Param(kind, "scale"), rg.Func("scaled"), rg.Var("x")
    f[x] = image[x] * scale
    return f, [image, scale]


def work(queue, module, tensors):
    """In a worker: the result and the gradient by the module's weight."""
    result = module(*tensors)
    result.sum().backward()
    queue.put((result.detach().numpy(), module.weight.grad.item()))


if __name__ == "__main__":  # torch_held.py MODULE TENSORS: what the stored module makes of the stored tensors
    module, tensors = (torch.load(file, weights_only=False) for file in sys.argv[1:3])
    result = module(*tensors)
    result.sum().backward()
    print(module.operator.name, result.tolist(), module.weight.grad.item(), tensors[0].grad.tolist())
