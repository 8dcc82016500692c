"""Array pipelines and their gradients, compiled for CPUs and CUDA devices.

    import numpy, retrograde as rg
    x, y = rg.Var("x"), rg.Var("y")
    f = rg.Func("f")
    f[x, y] = x + 10 * y
    a = numpy.asarray(f.realize([4, 3]))     # a[y, x] == f[x, y], always

Names and documentation are those of the C++ library; python_bindings/README.md describes what differs in Python.
`retrograde.runtime` runs functions that were compiled ahead of time, without the compiler.
"""
import importlib.util as _util

from ._errors import CompileError, Error, InternalError, RuntimeError, Unsupported, UserError

HalideError = Error  # name in Halide's package
__all__ = ["CompileError", "Error", "HalideError", "InternalError", "Unsupported", "UserError"]
# Names of built-ins: available as retrograde.sum, but not imported by `import *`.
_BUILTIN = {"RuntimeError", "abs", "max", "min", "pow", "print", "round", "sum"}  # and vars

if _util.find_spec("retrograde._retrograde") is None:
    def __getattr__(name):
        raise AttributeError(f"retrograde.{name}: this installation has the runtime alone, retrograde.runtime")
else:
    from . import _retrograde
    from ._retrograde import *
    from . import _display, _refusals
    from ._command_line import main
    from ._explain import explain
    from ._generator import *
    from ._linking import *
    from ._names import funcs, vars

    lambda_func = lambda_  # name in Halide's package
    for _name in ("abs", "max", "min", "pow", "print", "round", "sum", "_"):
        globals()[_name] = getattr(_retrograde, _name)
    for _n in range(10):
        globals()[f"_{_n}"] = getattr(_retrograde, f"_{_n}")
    __all__ += ["_", "explain", "funcs", "lambda_func", "main"] + _generator.__all__ + _linking.__all__ + [
        _name for _name in dir(_retrograde) if not _name.startswith("_") and _name not in _BUILTIN]
    __version__ = _retrograde.__version__
