"""The exceptions of the library. Each has the four parts of its message as attributes: the request (`asked`), the
`rule` that it breaks, the `evidence`, and advice on what to do `instead`."""
import builtins

__all__ = ["Error", "UserError", "CompileError", "RuntimeError", "Unsupported", "InternalError"]


class Error(Exception):
    """Base of all exceptions of the library."""

    asked = rule = evidence = instead = ""


class UserError(Error):
    """The program, the schedule or the arguments are illegal."""


class CompileError(UserError):
    """An error that is found while a pipeline is defined, scheduled or compiled."""


class RuntimeError(UserError, builtins.RuntimeError):
    """An error that is found while a compiled pipeline is called. `code` is its result; 0: a check failed."""

    code = 0


class Unsupported(Error, builtins.NotImplementedError):
    """The program is legal, but this compiler does not support it yet."""


class InternalError(Error):
    """A bug in the library. `pass_name` and `ir_before`, the program before the pass, belong in a bug report."""

    pass_name = ir_before = ""


for _class in (Error, UserError, CompileError, RuntimeError, Unsupported, InternalError):
    _class.__module__ = "retrograde"

def error(cls, asked, rule, evidence, instead):
    """An exception of class `cls` with the four parts of its message."""
    made = cls(f"cannot {asked}: {rule}; {evidence}. {instead}.")
    made.asked, made.rule, made.evidence, made.instead = asked, rule, evidence, instead
    return made
