"""Operators of PyTorch made of pipelines, with their gradients.

    import retrograde as rg, torch
    from retrograde.torch import operator
    x, k, image, taps, blur = rg.Var("x"), rg.RDom([(0, 3)]), rg.ImageParam("float32", 1, "image"), \
        rg.ImageParam("float32", 1, "taps"), rg.Func("blur")
    blur[x] += image[x + k] * taps[k]
    op = operator(blur, [image, taps], sizes=lambda image, taps: [len(image) - 2])
    weights = torch.ones(3, requires_grad=True)
    op(torch.rand(64), weights).sum().backward()          # weights.grad is there

Tensors are those of the CPU, of any strides, and are not copied; the axis rule is the package's: t[y, x] == f[x, y].
Gradients are pipelines, made when they are first asked for, of exactly those inputs that want one; they are operators
themselves, so that they are differentiated again. Their bits are the same from run to run.
"""
import itertools
import threading

import torch

from . import _retrograde as rg
from ._errors import CompileError, error

__all__ = ["Operator", "operator"]

DTYPES = {torch.float16: rg.Float(16), torch.bfloat16: rg.BFloat(16), torch.float32: rg.Float(32),
          torch.float64: rg.Float(64), torch.uint8: rg.UInt(8), torch.int8: rg.Int(8), torch.int16: rg.Int(16),
          torch.int32: rg.Int(32), torch.int64: rg.Int(64), torch.bool: rg.Bool()}
TYPES = {str(kind): dtype for dtype, kind in DTYPES.items()}
_numbers = itertools.count()


def operator(outputs, inputs, sizes=None):
    """A function of tensors for ImageParams, and tensors or numbers for Params, in the order of `inputs`, that gives a
    tensor for a Func, and a tuple of them for a list. `sizes`: those of the outputs in the order of Funcs, innermost
    first; or a function of the tensors that gives them; None: those of the first image."""
    return Operator(outputs, inputs, sizes)


def _buffer(tensor):
    tensor = tensor.detach()
    return rg.Buffer(tensor if tensor.dtype == torch.bfloat16 else tensor.numpy())  # NumPy's way is the shorter


def _is_floating(parameter):
    return parameter.type().is_float() or parameter.type() == rg.BFloat(16)


class Operator:
    """See `operator`."""

    def __init__(self, outputs, inputs, sizes=None):
        self.single = isinstance(outputs, rg.Func)
        self.outputs, self.inputs = [outputs] if self.single else list(outputs), list(inputs)
        for f in self.outputs:
            if f.outputs() != 1:
                raise error(CompileError, f'make an operator of "{f.name()}"', "a tensor holds one value at each point",
                            f"it has {f.outputs()} values", "Give a Func for each of them")
        self._sizes = sizes if callable(sizes) or sizes is None else lambda *tensors: sizes
        self._lock, self._callable, self._gradients = threading.Lock(), None, {}

    def __call__(self, *tensors):
        if len(tensors) != len(self.inputs):
            raise TypeError(f"the operator takes {', '.join(i.name() for i in self.inputs)}")
        for parameter, tensor in zip(self.inputs, tensors):
            self._check(parameter, tensor)
        results = _Function.apply(self, *tensors)
        return results[0] if self.single else results

    @staticmethod
    def _check(parameter, tensor):
        is_image = isinstance(parameter, rg.ImageParam)
        if not isinstance(tensor, torch.Tensor):
            if is_image:
                raise TypeError(f"{parameter.name()} is a tensor, not {type(tensor).__name__}")
            return
        if tensor.device.type != "cpu":
            raise TypeError(f"{parameter.name()} is a tensor of the CPU, not of {tensor.device}")
        dimensions = parameter.dimensions() if is_image else 0
        if DTYPES.get(tensor.dtype) != parameter.type() or tensor.dim() != dimensions:
            raise TypeError(f"{parameter.name()} holds {parameter.type()} over {dimensions} dimensions, not {tensor.dtype} "
                            f"over {tensor.dim()}")

    def shapes(self, tensors):
        """Those of the outputs, as PyTorch orders them."""
        if self._sizes is None:
            first = next(t for p, t in zip(self.inputs, tensors) if isinstance(p, rg.ImageParam))
            return [tuple(first.shape)] * len(self.outputs)
        given = self._sizes(*tensors)
        each = given if given and isinstance(given[0], (list, tuple)) else [given] * len(self.outputs)
        return [tuple(reversed([int(n) for n in one])) for one in each]

    def run(self, tensors):
        with self._lock:
            if self._callable is None:
                self._callable = rg.Pipeline(self.outputs).compile_to_callable(self.inputs)
        results = tuple(torch.empty(shape, dtype=TYPES[str(f.type())])
                        for f, shape in zip(self.outputs, self.shapes(tensors)))
        given = [_buffer(t) if isinstance(p, rg.ImageParam) else t.item() if isinstance(t, torch.Tensor) else t
                 for p, t in zip(self.inputs, tensors)]
        self._callable(*given, *[_buffer(t) for t in results])
        return results

    def gradient(self, wanted):
        """The operator of the inputs and a seed for each output, that gives the gradients by the wanted inputs."""
        with self._lock:
            if wanted not in self._gradients:
                self._gradients[wanted] = self._make_gradient([self.inputs[i] for i in wanted], wanted)
            return self._gradients[wanted]

    def _make_gradient(self, by, wanted):
        seeds, derivatives = [], []
        for f in self.outputs:
            seed = rg.ImageParam(f.type(), f.dimensions(), f"seed_{next(_numbers)}")
            seeds.append(seed)
            if f.type().is_float():
                bounds = [(seed.dim(d).min(), seed.dim(d).extent()) for d in range(seed.dimensions())]
                derivatives.append(rg.propagate_adjoints(f, rg.Func(seed), bounds, rg.AdjointOptions(wrt=by)))
        gradients = [self._sum([d(parameter) for d in derivatives], parameter) for parameter in by]

        def sizes(*tensors):
            return [list(reversed(getattr(tensors[i], "shape", ()))) for i in wanted]

        return Operator(gradients, self.inputs + seeds, sizes)

    @staticmethod
    def _sum(parts, parameter):
        """One Func for each input, of its own type: parts may be shared, and wider."""
        total = rg.Func(f"gradient_{next(_numbers)}")
        value = rg.cast(parameter.type(), 0)
        for part in parts:
            value = value + rg.cast(parameter.type(), part[...])
        dimensions = parameter.dimensions() if isinstance(parameter, rg.ImageParam) else 0
        total[tuple(rg.Var() for _ in range(dimensions)) if not parts else ...] = value
        return total


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(ctx, op, *tensors):
        ctx.op, ctx.numbers = op, [None if isinstance(t, torch.Tensor) else t for t in tensors]
        ctx.save_for_backward(*[t for t in tensors if isinstance(t, torch.Tensor)])
        return op.run(tensors)

    @staticmethod
    def backward(ctx, *seeds):
        saved = iter(ctx.saved_tensors)
        tensors = [next(saved) if number is None else number for number in ctx.numbers]
        wanted = tuple(i for i, p in enumerate(ctx.op.inputs) if ctx.needs_input_grad[i + 1] and _is_floating(p))
        results = [None] * len(tensors)
        if wanted:
            for i, gradient in zip(wanted, ctx.op.gradient(wanted)(*tensors, *seeds)):
                results[i] = gradient
        return (None, *results)
