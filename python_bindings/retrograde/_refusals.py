"""Refuses uses of expressions, Funcs and images that Python or another library would misunderstand.

Iteration over a Func or an image would never end, because any coordinate may be read. Functions of `math`, NumPy and
PyTorch work on numbers and arrays. The errors name the function of this package to use instead.
"""
import numpy

from . import _retrograde as rg
from ._errors import CompileError, error

# Functions whose names here differ from those of NumPy and PyTorch.
_NAMES = {"maximum": "max", "minimum": "min", "fmax": "max", "fmin": "min", "absolute": "abs", "fabs": "abs",
          "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "arcsinh": "asinh",
          "arccosh": "acosh", "arctanh": "atanh", "rint": "round", "isnan": "is_nan", "isinf": "is_inf",
          "isfinite": "is_finite", "float_power": "pow", "where": "select"}
# Ufuncs that NumPy calls for the operators of Python. They apply these to each element.
_OPERATORS = {"add", "subtract", "multiply", "divide", "true_divide", "floor_divide", "remainder", "power", "negative",
              "positive", "absolute", "invert", "bitwise_and", "bitwise_or", "bitwise_xor", "left_shift",
              "right_shift", "less", "less_equal", "greater", "greater_equal", "equal", "not_equal"}
_TENSOR_OPERATORS = {prefix + name for prefix in ("", "r", "i") for name in (
    "add", "sub", "mul", "div", "truediv", "floordiv", "mod", "pow", "and", "or", "xor", "lshift", "rshift")} | {
    "true_divide", "floor_divide", "remainder", "eq", "ne", "lt", "le", "gt", "ge"}
EXPRESSIONS = (rg.Expr, rg.Var, rg.RVar, rg.RDom, rg.Param, rg.FuncRef, rg.FuncTupleElementRef)


def _described(thing):
    if isinstance(thing, (rg.Func, rg.ImageParam)):
        return f'the {type(thing).__name__} "{thing.name()}"'
    return "an expression"


def _refuse_iteration(self):
    raise error(TypeError, f"iterate over {_described(self)}", "its elements are computed when a pipeline runs",
                "any coordinate may be read, so there is no last one",
                "Reduce it over an RDom, as in rg.sum(f[r]), or realize() it and iterate over the result")


def _refuse_membership(self, value):
    raise error(TypeError, f"search {_described(self)}", "its elements are computed when a pipeline runs",
                "`in` needs them now", "Compare elements in a reduction over an RDom, or realize() it and search the "
                "result")


def _refuse_float(self):
    raise error(TypeError, "take an expression as a float of Python", "its value is known when a pipeline runs, not "
                "before", f"it is {self}", "Use the function of this package: rg.sqrt(e) instead of math.sqrt(e)")


def _advice(name):
    """What to write instead of a function of another library."""
    name = _NAMES.get(name, name)
    if name in rg.__dict__ and not name.startswith("_"):
        return f"Write rg.{name}(...)"
    return "Write it with functions and operators of this package"


def _refuse_function(library, name):
    raise error(TypeError, f"apply {library}.{name} to an expression", f"functions of {library} take values",
                "an expression has its value when a pipeline runs, not before", _advice(name))


def _array_ufunc(self, ufunc, method, *inputs, **options):
    """NumPy calls it for an array or a NumPy scalar next to an expression, and for numpy.exp(e)."""
    if ufunc.__name__ not in _OPERATORS:
        _refuse_function("numpy", ufunc.__name__)
    return getattr(ufunc, method)(*[_as_element(one) for one in inputs], **options)


def _as_element(one):
    """An expression as an array without axes, whose element it is."""
    if not isinstance(one, EXPRESSIONS):
        return one
    made = numpy.empty((), dtype=object)
    made[()] = one
    return made


def _torch_function(cls, function, types, inputs=(), options=None):
    """PyTorch calls it for a tensor next to an expression, and for torch.exp(e)."""
    name = getattr(function, "__name__", str(function))
    if name.strip("_") in _TENSOR_OPERATORS:
        # Tensors replace a TypeError of an operator by one that only names the two classes.
        raise error(CompileError, "combine a tensor and an expression", "an operand is a number, a Var, a Func at a "
                    "point or another Expr", "one operand is a tensor", "Read the tensor through an ImageParam or a "
                    "Buffer, as in rg.Buffer(t)[x], or take its number with t.item()")
    _refuse_function("torch", name)


for _class in (rg.Func, rg.ImageParam):
    _class.__iter__, _class.__contains__ = _refuse_iteration, _refuse_membership
for _class in EXPRESSIONS:
    _class.__float__ = _refuse_float
    _class.__array_ufunc__, _class.__torch_function__ = _array_ufunc, classmethod(_torch_function)
