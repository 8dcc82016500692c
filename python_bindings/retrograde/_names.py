"""Several Vars or Funcs by one text."""
from . import _retrograde as rg


def vars(names):
    """Vars of these names, with spaces or commas between: x, y = rg.vars("x y")."""
    return tuple(rg.Var(name) for name in names.replace(",", " ").split())


def funcs(names):
    """Funcs of these names, with spaces or commas between: blur, sharp = rg.funcs("blur sharp")."""
    return tuple(rg.Func(name) for name in names.replace(",", " ").split())
