"""The exceptions of the library. Each has the four parts of its message as attributes: the request (`asked`), the
`rule` that it breaks, the `evidence`, and advice on what to do `instead`."""
import builtins
import re

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


# Advice of the C++ library in its syntax, and how Python writes it.
_SYNTAX = [
    (r"^Convert it(?::| with) cast<int>(\(\.\.\.\))?$", "Divide integers with //, or convert it: rg.i32(...)"),
    (r"\bcast<int>(?:\((?=[\w.])|$)", lambda m: "rg.i32(" if m[0].endswith("(") else "rg.i32(...)"),
    (r"\bcast<>\(\)", "rg.cast(type, e)"),
    (r"(?<![\w.])(floor|round|sum|select|scatter|gather|get_host_target)\(", r"rg.\1("),
    (r"\b([A-Z]\w+)::(?=[A-Z])", r"rg.\1."),
    (r"\b([A-Z]\w+)\{\.(\w+) = ([^{}]*)\}", r"rg.\1(\2=\3)"),
    (r"(?<![\w.])([a-z]\w*)\(\)(?= \+?=)", r"\1[()]"),
    (r"(?<![\w.])f\(((?:[^()]|\([^()]*\))+)\)", r"f[\1]"),
]


def in_python(words, instead):
    """A message of the C++ library and its advice, `instead`, with the advice in Python's syntax."""
    advice = instead
    for pattern, replacement in _SYNTAX:
        advice = re.sub(pattern, replacement, advice)
    at = words.rfind(instead[1:]) - 1 if instead else -1  # the message may begin it with a capital
    if advice == instead or at < 0:
        return words, instead
    return words[:at] + advice[:1].upper() + advice[1:] + words[at + len(instead):], advice
