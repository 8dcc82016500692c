"""The sizes of an operator's results, as a function of the tensors of a call.

Sizes are numbers, a function of the tensors, or expressions of the sizes of images, such as image.dim(0).extent() - 2.
Under torch.compile the sizes of tensors are symbols. Expressions are therefore evaluated with Python's operators, which
symbols have.
"""
import math
import operator

import torch

from .. import _retrograde as rg
from .._errors import CompileError, Unsupported, error
from .._refusals import EXPRESSIONS

_smaller, _larger = getattr(torch, "sym_min", min), getattr(torch, "sym_max", max)
_float, _int = getattr(torch, "sym_float", float), getattr(torch, "sym_int", int)


def _divided(a, b):
    """Integers: rounds so that the remainder is never negative, and x / 0 == 0."""
    if isinstance(a, _FLOATS):
        return a / b
    if b == 0:
        return 0
    return a // b if b > 0 else -(a // -b)


def _remainder(a, b):
    if isinstance(a, _FLOATS):
        return a % b
    return a % abs(b) if b != 0 else 0


_FLOATS = (float, torch.SymFloat) if hasattr(torch, "SymFloat") else (float,)
_OPERATIONS = {
    "Add": operator.add, "Sub": operator.sub, "Mul": operator.mul, "Div": _divided, "Mod": _remainder,
    "Min": _smaller, "Max": _larger, "EQ": operator.eq, "NE": operator.ne, "LT": operator.lt, "LE": operator.le,
    "GT": operator.gt, "GE": operator.ge, "And": lambda a, b: a and b, "Or": lambda a, b: a or b,
    "Not": operator.not_, "Select": lambda condition, a, b: a if condition else b, "abs": abs,
    "floor": lambda a: _float(math.floor(a)), "ceil": lambda a: _float(math.ceil(a)), "trunc": lambda a: _float(_int(a)),
    "shift_left": lambda a, n: a * 2 ** n, "shift_right": lambda a, n: a // 2 ** n,
}


class Sizes:
    """Computes the shapes of the results, in PyTorch's order, from the tensors of one batch item. `given` is the user's
    argument `outputs`, `count` the number of results."""

    def __init__(self, name, given, inputs, count):
        self.name, self._given, self._inputs, self._count = name, given, list(inputs), count
        self._first = None
        if given is None:
            self._first = next((i for i, one in enumerate(inputs) if isinstance(one, rg.ImageParam)), None)
            if self._first is None:
                raise error(CompileError, "make an operator without images", "the sizes of its results are known",
                            "there is no image whose sizes they could have", "Give `outputs`: their sizes")

    def __call__(self, tensors):
        if self._first is not None:
            return [tuple(tensors[self._first].shape)] * self._count
        given = self._given(*tensors) if callable(self._given) else self._given
        each = given if given and isinstance(given[0], (list, tuple)) else [given] * self._count
        return [tuple(self._size(size, one, tensors) for size in reversed(one)) for one in each]

    def _size(self, size, sizes, tensors):
        """One size of a result as a number or a symbol."""
        if isinstance(size, EXPRESSIONS):
            size = self._value(rg._terms(rg.Expr(size)), tensors)
        if isinstance(size, _FLOATS):
            self._refuse(sizes, tensors, "a size is an integer", f"{size} is a float", "Divide with // instead of /")
        if type(size) is int and size < 0:
            self._refuse(sizes, tensors, "a size is not negative", f"one is {size}", "Give larger tensors")
        return size

    def _refuse(self, sizes, tensors, rule, evidence, instead):
        given = ", ".join(f"{one.name()} {list(t.shape)}" for one, t in zip(self._inputs, tensors))
        raise error(ValueError, f'compute the sizes of the results of "{self.name}"', rule,
                    f"{evidence}, where the tensors are {given}", instead)

    def _value(self, terms, tensors):
        if not isinstance(terms, tuple):
            return terms
        name, *operands = terms
        if name == "Variable":
            return self._variable(operands[0], tensors)
        if name == "Cast":
            value = self._value(operands[1], tensors)
            return _float(value) if "float" in operands[0] else _int(value)
        if name in _OPERATIONS:
            return _OPERATIONS[name](*[self._value(one, tensors) for one in operands])
        raise error(Unsupported, f'compute the sizes of the results of "{self.name}"', "they follow from sizes of "
                    "images and from numbers, by arithmetic", f"one needs {operands[0] if name == 'Unknown' else name}",
                    "Give `sizes` as a function of the tensors")

    def _variable(self, name, tensors):
        for parameter, t in zip(self._inputs, tensors):
            if not isinstance(parameter, rg.ImageParam):
                if parameter.name() == name and t.device.type != "meta":
                    return t.item()
            elif name.startswith(parameter.name() + "."):
                kind, _, dimension = name[len(parameter.name()) + 1:].partition(".")
                if kind in ("extent", "min"):
                    return t.shape[-1 - int(dimension)] if kind == "extent" else 0
        raise error(Unsupported, f'compute the sizes of the results of "{self.name}"', "they follow from the sizes of "
                    "its images", f'they read "{name}", whose value is not known where only shapes are',
                    "Take sizes from the inputs of the operator: image.dim(0).extent()")
