"""Creates several Vars or Funcs from one string of names."""
from . import _retrograde as rg


def vars(names):
    """Vars with these names, separated by spaces or commas: x, y = rg.vars("x y")."""
    return tuple(rg.Var(name) for name in names.replace(",", " ").split())


def funcs(names):
    """Funcs with these names, separated by spaces or commas: blur, sharp = rg.funcs("blur sharp")."""
    return tuple(rg.Func(name) for name in names.replace(",", " ").split())
