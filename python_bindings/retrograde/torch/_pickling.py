"""Pickles operators, for deep copies, torch.save of whole modules, and arguments of worker processes.

An operator is registered once in a process and never changes, so a copy is the operator itself. A pickle holds its name
and a description from which another process can create it: the function that defines it, or its pipeline as text with
the Buffers that it uses. Functions of a module are stored by name, as pickles do. Others (lambdas, nested functions)
are stored as code, which works in one version of Python only.
"""
import dis
import importlib
import importlib.util
import marshal
import sys
import types

from .. import _retrograde as rg
from .._errors import CompileError, error


class Function:
    """A function in a pickle. The globals that it uses are stored too: modules by name, all others as pickles do."""

    def __init__(self, function):
        self.function = function

    def __reduce__(self):
        if not isinstance(self.function, types.FunctionType) or _is_in_a_module(self.function):
            return Function, (self.function,)
        return _function_of_code, _parts(self.function)


def _is_in_a_module(function):
    found = sys.modules.get(function.__module__)
    for name in function.__qualname__.split("."):
        found = getattr(found, name, None)
    return found is function


def _parts(function):
    code = function.__code__
    mentioned = {name: function.__globals__[name] for name in _names_in(code) if name in function.__globals__}
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    if any(value is function for value in [*mentioned.values(), *cells]):
        raise error(CompileError, f'store the function "{function.__qualname__}"',
                    "a function that is in no module is stored with what it mentions", "it mentions itself",
                    "Move it to the top of a module")
    return (importlib.util.MAGIC_NUMBER, marshal.dumps(code), function.__module__, function.__qualname__,
            [_packed(value) for value in cells], _packed(function.__defaults__), _packed(function.__kwdefaults__),
            {name: _packed(value) for name, value in mentioned.items()})


def _names_in(code):
    names = {step.argval for step in dis.get_instructions(code) if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names_in(constant)
    return names


def _packed(value):
    if isinstance(value, types.ModuleType):
        return "module", value.__name__
    if isinstance(value, types.FunctionType):
        return "function", Function(value)
    return "value", value


def _unpacked(packed):
    kind, value = packed
    if kind == "module":
        return importlib.import_module(value)
    return value.function if kind == "function" else value


def _function_of_code(magic, code, module, name, cells, defaults, keywords, mentioned):
    if magic != importlib.util.MAGIC_NUMBER:
        raise error(CompileError, f'make the function "{name}" again',
                    "a function that is in no module is stored as the code of one version of Python",
                    f"this is Python {sys.version.split()[0]}, and it was stored by another",
                    "Move it to the top of a module, and store it again")
    space = {"__builtins__": __builtins__, "__name__": module,
             **{word: _unpacked(value) for word, value in mentioned.items()}}
    made = types.FunctionType(marshal.loads(code), space, name.rpartition(".")[2], _unpacked(defaults),
                              tuple(types.CellType(_unpacked(cell)) for cell in cells))
    made.__kwdefaults__, made.__qualname__ = _unpacked(keywords), name
    return Function(made)


def describe(funcs, single, inputs, outputs):
    """The arguments of operator() in a form that can be pickled."""
    text, buffers = rg._describe_pipeline(rg.Pipeline(funcs))
    kinds = [(parameter.name(), str(parameter.type()),
              parameter.dimensions() if isinstance(parameter, rg.ImageParam) else None) for parameter in inputs]
    return text, buffers, single, kinds, stored_outputs(outputs)


def stored_outputs(outputs):
    """The argument `outputs` of operator() in a form that can be pickled."""
    return Function(outputs) if callable(outputs) else outputs


def restored_outputs(outputs):
    return outputs.function if isinstance(outputs, Function) else outputs


def described(text, buffers, single, kinds, outputs):
    """The inverse of `describe`: (pipeline, inputs, outputs)."""
    funcs, found = rg._pipeline_described(text, buffers)
    inputs = []
    for name, kind, dimensions in kinds:  # the pipeline need not read all of them
        made = found.get(name)
        if made is None:
            made = rg.Param(kind, name) if dimensions is None else rg.ImageParam(kind, dimensions, name)
        inputs.append(made)
    return (funcs[0] if single else funcs), inputs, restored_outputs(outputs)
