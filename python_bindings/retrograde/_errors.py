"""The exceptions of the library. Each carries the four parts of its message: what was `asked`, the `rule` that this
breaks, the `evidence`, and what to do `instead`."""
import builtins

__all__ = ["Error", "UserError", "CompileError", "RuntimeError", "Unsupported", "InternalError"]


class Error(Exception):
    """Base of all: catch this to catch everything the library reports."""

    asked = rule = evidence = instead = ""


class UserError(Error):
    """The program, the schedule or the arguments are illegal."""


class CompileError(UserError):
    """Found while a pipeline is defined, scheduled or compiled."""


class RuntimeError(UserError, builtins.RuntimeError):
    """Found while a compiled pipeline is called. `code` is what it returned, 0 when the check came before the call."""

    code = 0


class Unsupported(Error, builtins.NotImplementedError):
    """Legal, but a known gap of this compiler."""


class InternalError(Error):
    """A bug of the library. `pass_name` and `ir_before` are what a report of it needs."""

    pass_name = ir_before = ""


for _class in (Error, UserError, CompileError, RuntimeError, Unsupported, InternalError):
    _class.__module__ = "retrograde"

def error(cls, asked, rule, evidence, instead):
    """An exception of this class with the four parts, and their text."""
    made = cls(f"cannot {asked}: {rule}; {evidence}. {instead}.")
    made.asked, made.rule, made.evidence, made.instead = asked, rule, evidence, instead
    return made
