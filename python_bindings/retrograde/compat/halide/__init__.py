"""Runs programs written for Halide's Python package without changes. With this folder's parent on PYTHONPATH,

    import halide as hl

imports Retrograde under that name, with the behaviour of Halide's package:

- text that pipelines print, and warnings of the compiler, go to sys.stdout, and objects have reprs such as
  <halide.Var 'x'>; both also apply to pipelines that the process builds through `import retrograde`;
- rounding a Python float to float32 raises a RuntimeWarning if the value changes;
- an RDom index out of range raises KeyError; argmin and argmax return Python tuples.
"""
import atexit as _atexit
import sys as _sys

import retrograde as _own
from retrograde import _retrograde as _module

globals().update({name: getattr(_own, name) for name in dir(_own) if not name.startswith("__")})
__version__ = _own.__version__


def argmin(*args, **named):
    return tuple(_own.argmin(*args, **named))


def argmax(*args, **named):
    return tuple(_own.argmax(*args, **named))


class RDom(_own.RDom):
    def __getitem__(self, index):
        if isinstance(index, int) and not 0 <= index < len(self):
            raise KeyError(f"there are {len(self)} variables, numbered from 0")
        return super().__getitem__(index)


def _write(text):
    _sys.stdout.write(text)


def _warn(text):
    if not text.startswith("performance note"):
        _sys.stdout.write(f"Warning: {text}\n")


def _tell_nobody():
    _module._set_default_print(None)
    _module._set_warning_handler(None)


def _shown_as(kind, content):
    kind.__repr__ = lambda self: f"<halide.{kind.__name__} {content(self)}>"


def _renamed(kind):
    own = kind.__repr__
    kind.__repr__ = lambda self: own(self).replace("<retrograde.", "<halide.", 1)


_module._set_default_print(_write)
_module._set_warning_handler(_warn)
_module._warn_of_rounding(True)
_atexit.register(_tell_nobody)

for _kind in {k for k in _own.__dict__.values() if isinstance(k, type) and "__repr__" in k.__dict__}:
    if _kind.__module__.startswith("retrograde"):
        _renamed(_kind)
_shown_as(_own.Var, lambda v: f"'{v.name()}'")
_shown_as(_own.RVar, lambda v: v.name())
_shown_as(_own.Func, lambda f: f"'{f.name()}'")
_shown_as(_own.Target, str)
_shown_as(_own.Expr, lambda e: f"of type {e.type()}: {e}")
