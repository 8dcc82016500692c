"""program.py -- the base class of the programs: a pipeline beside the usual PyTorch code, and tensors for both."""

PROGRAMS = {}  # by name, in the order of the definitions


class Program:
    """A program is a class with three functions and is never instantiated:

    - `inputs(values, small)` returns the tensors in float64; values(*shape, low=0, high=1) draws random ones. Index
      arrays are tensors of integers.
    - `define(*shapes)` returns the output or outputs, the inputs, and the sizes of the results, innermost first. Shapes
      are in PyTorch's order: t[y, x] == f[x, y].
    - `pytorch(*tensors)` returns the same results.
    """

    constants = ()  # positions of inputs, in addition to those of integers, for which nobody asks the gradient
    tolerance = 1e-4  # maximum relative error of the result and of each gradient

    def __init_subclass__(cls):
        cls.name = "".join("_" * (i > 0 and c.isupper()) + c.lower() for i, c in enumerate(cls.__name__))
        PROGRAMS[cls.name] = cls

    @classmethod
    def operator(cls, shapes, namespace):
        """The program as an operator for tensors of these shapes."""
        from retrograde.torch import operator

        return operator(f"{namespace}::{cls.name}", lambda kind, _: cls.define(*shapes))
