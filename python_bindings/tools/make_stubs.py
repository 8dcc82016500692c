#!/usr/bin/env python3
"""make_stubs -- writes type stubs of the extension module, for editors and type checkers.

    make_stubs.py FOLDER        writes the .pyi files of the package retrograde in this folder

Signatures and docstrings are read from the compiled module, which has them from the C++ code and the comments of the
headers, so the stubs always agree with it. The unions below list what an argument accepts beyond its class
(casters.h).
"""
import inspect
import keyword
import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True

# The union that an argument of each class accepts.
LIKE = {
    "Expr": "ExprLike", "Tuple": "TupleLike", "Type": "TypeLike", "Buffer": "ArrayLike", "VarOrRVar": "LoopLike",
    "Range": "RangeLike", "Func": "FuncLike", "AdjointInput": "InputLike", "Direction": "DirectionLike",
    "Argument": "ArgumentLike",
}
HEAD = '''\
"""The extension module: written by python_bindings/tools/make_stubs.py."""
import typing
from typing import Any, Callable as function, Dict, Iterable, Iterator, List, Optional, Sequence, Set, Union, overload
from typing import Tuple as tuple_of

ExprLike = Union["Expr", "Var", "RVar", "RDom", "Param", "FuncRef", "FuncTupleElementRef", int, float, str, Any]
TupleLike = Union["Tuple", Sequence[ExprLike], ExprLike]
TypeLike = Union["Type", str, Any]
ArrayLike = Union["Buffer", Any]
LoopLike = Union["Var", "RVar", "RDom"]
RangeLike = Union["Range", tuple_of[Optional[ExprLike], Optional[ExprLike]]]
FuncLike = Union["Func", "ImageParam", "Buffer"]
InputLike = Union["AdjointInput", "Func", "ImageParam", "Param", "Buffer"]
DirectionLike = Union["Direction", tuple_of[InputLike, Any]]
ArgumentLike = Union["Argument", "Param", "ImageParam", "Buffer"]
'''
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w+)\((.*)\)(?: -> (.*))?$")


def split_arguments(text):
    """Splits at the commas outside of brackets and quotes."""
    parts, depth, begin, quote = [], 0, 0, ""
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c in "([{<":
            depth += 1
        elif c in ")]}>":
            depth -= text[i - 1] != "-" or c != ">"
        elif c == "," and depth == 0:
            parts.append(text[begin:i].strip())
            begin = i + 1
    return [p for p in parts + [text[begin:].strip()] if p]


class Writer:
    def __init__(self, module):
        self.module, self.lines = module, [HEAD]
        self.names = {n for n in dir(module)}

    # ---- types ----

    def type_of(self, text, is_argument):
        """A type as the stub writes it; C++ types without a Python class become Any."""
        text = re.sub(r"retrograde\._retrograde\.", "", text.strip())
        text = re.sub(r"\bTuple\[", "tuple_of[", text)
        text = re.sub(r"\bCallable\b(?=\[)", "function", text)
        text = re.sub(r"\b(std::|retrograde::|py::|pybind11::)[\w:<>, ]*", "Any", text)
        text = re.sub(r"\b(handle|object|function|iterable|args|kwargs|capsule)\b", "Any", text)
        if not re.fullmatch(r"[\w\s\[\],.]+", text):
            return "Any"
        if is_argument:
            text = re.sub(r"\b\w+\b(?!\.)", lambda m: LIKE.get(m.group(0), m.group(0)), text)
        elif "VarOrRVar" in text:
            text = text.replace("VarOrRVar", "LoopLike")
        return text

    def argument(self, text):
        if text.startswith("*"):
            return text.split(":")[0]
        name, _, rest = text.partition(":")
        if not rest:
            return name
        kind, equals, _ = rest.partition(" = ")
        return f"{name.strip()}: {self.type_of(kind, True)}" + (" = ..." if equals else "")

    def arguments(self, text):
        given = [self.argument(part) for part in split_arguments(text)]
        given = [re.sub(r"^self: .*", "self", part) for part in given]
        # arguments without a name
        return ", ".join(re.sub(r"^arg(\d+): ", r"__arg\1: ", part) for part in given)

    # ---- functions ----

    @staticmethod
    def overloads(function):
        """The signature and the documentation of each overload."""
        text = inspect.getdoc(function) or ""
        first, _, rest = text.partition("\n")
        if "Overloaded function." not in text.split("\n\n")[0] + text.split("\n\n", 2)[min(1, text.count("\n\n"))]:
            match = SIGNATURE.match(first)
            return [(match, rest.strip())] if match else []
        found = []
        for line in rest.split("\n"):
            match = SIGNATURE.match(line) if re.match(r"\d+\. ", line) else None
            if match:
                found.append((match, []))
            elif found:
                found[-1][1].append(line)
        return [(match, "\n".join(lines).strip()) for match, lines in found]

    def docstring(self, text, indent):
        if not text:
            return f"{indent}    ...\n"
        safe = text.replace("\\", "\\\\").replace('"""', "'''")
        body = f"\n{indent}    ".join(safe.split("\n"))
        return f'{indent}    """{body}"""\n'

    def function(self, name, function, indent="", decorator=""):
        overloads = self.overloads(function)
        if not overloads:
            self.lines.append(f"{indent}def {name}(*args: Any, **named: Any) -> Any: ...\n")
            return
        said = set()
        for match, text in overloads:
            head = f"{indent}@overload\n" if len(overloads) > 1 else ""
            head += f"{indent}@{decorator}\n" if decorator else ""
            result = self.type_of(match.group(3) or "Any", False)
            self.lines.append(f"{head}{indent}def {name}({self.arguments(match.group(2))}) -> {result}:\n"
                              + self.docstring("" if text in said else text, indent))
            said.add(text)

    # ---- classes ----

    def enumeration(self, cls, indent):
        for name in cls.__members__:
            if not keyword.iskeyword(name):  # DeviceAPI.None is reached by getattr alone
                self.lines.append(f"{indent}    {name}: {cls.__qualname__}\n")
        self.lines.append(f"{indent}    __members__: Dict[str, {cls.__qualname__}]\n{indent}    name: str\n{indent}    value: int\n"
                          f"{indent}    def __int__(self) -> int: ...\n")

    def class_(self, name, cls, indent=""):
        bases = [b.__name__ for b in cls.__bases__ if b.__module__ == self.module.__name__]
        self.lines.append(f"\n{indent}class {name}{'(' + ', '.join(bases) + ')' if bases else ''}:\n"
                          + self.docstring(inspect.getdoc(cls) or "", indent))
        if hasattr(cls, "__members__"):
            return self.enumeration(cls, indent)
        for member, value in sorted(vars(cls).items()):
            self.member(cls, member, value, indent + "    ")

    def member(self, cls, name, value, indent):
        if name == "__iter__" and inspect.isfunction(value):  # retrograde/_refusals.py
            return self.lines.append(f"{indent}__iter__: None\n")
        if name.startswith("__") and name not in ("__init__", "__call__", "__getitem__", "__setitem__", "__len__",
                                                  "__enter__", "__exit__", "__iter__", "__bool__"):
            return self.operator(name, indent)
        if name.startswith("_"):
            return None
        if inspect.isclass(value):
            return self.class_(name, value, indent)
        if isinstance(value, property):
            text = inspect.getdoc(value) or ""
            setter = f"{indent}@{name}.setter\n{indent}def {name}(self, value: Any) -> None: ...\n" if value.fset else ""
            head = f"{indent}@property\n{indent}def {name}(self) -> Any:\n"
            return self.lines.append(head + self.docstring(text, indent) + setter)
        if isinstance(value, staticmethod) or type(value).__name__ == "builtin_function_or_method":
            return self.function(name, getattr(cls, name), indent, "staticmethod")
        if callable(value):
            return self.function(name, value, indent)
        return self.lines.append(f"{indent}{name}: Any\n")

    def operator(self, name, indent):
        """Operators of Expr and similar classes, whose real signatures only mention `object`."""
        if re.fullmatch(r"__r?(add|sub|mul|truediv|floordiv|mod|pow|and|or|xor|lshift|rshift)__", name):
            self.lines.append(f"{indent}def {name}(self, other: ExprLike) -> Expr: ...\n")
        elif name in ("__lt__", "__le__", "__gt__", "__ge__"):
            self.lines.append(f"{indent}def {name}(self, other: ExprLike) -> Expr: ...\n")
        elif name in ("__neg__", "__pos__", "__invert__", "__abs__"):
            self.lines.append(f"{indent}def {name}(self) -> Expr: ...\n")

    # ---- modules ----

    def submodule(self, name, module):
        self.lines.append(f"\nclass {name}:\n" + self.docstring(inspect.getdoc(module) or "", ""))
        for member, value in sorted(vars(module).items()):
            if not member.startswith("__"):
                self.function(member, value, "    ", "staticmethod")

    def write(self):
        for name, value in sorted(vars(self.module).items()):
            if name.startswith("__"):
                continue
            if inspect.isclass(value) and value.__qualname__ != name:
                self.lines.append(f"{name} = {value.__qualname__}\n")
            elif inspect.isclass(value):
                self.class_(name, value)
            elif inspect.ismodule(value):
                self.submodule(name, value)
            elif callable(value) and hasattr(value, "__doc__") and type(value).__name__ == "builtin_function_or_method":
                self.function(name, value)
            else:
                self.lines.append(f"{name}: {type(value).__name__ if type(value).__name__ in self.names else 'Any'}\n")
        return "".join(self.lines)


def package_stub(module):
    hidden = sorted(n for n in dir(module) if n.startswith("_") and not n.startswith("__"))
    return ("from ._retrograde import *\n"
            + "".join(f"from ._retrograde import {name} as {name}\n" for name in hidden)
            + "from ._errors import Error as HalideError\nfrom ._errors import CompileError as CompileError, Error as Error, InternalError as InternalError\n"
              "from ._errors import RuntimeError as RuntimeError, Unsupported as Unsupported, UserError as UserError\n"
              "from ._command_line import main as main\nfrom ._explain import explain as explain\nfrom ._generator import *\nfrom ._linking import *\n"
              "from ._names import funcs as funcs, vars as vars\nfrom ._retrograde import lambda_ as lambda_func\n\n"
              "__version__: str\n")


def main(folder):
    sys.path.insert(0, str(folder))
    from retrograde import _retrograde
    package = folder / "retrograde"
    (package / "_retrograde.pyi").write_text(Writer(_retrograde).write())
    (package / "__init__.pyi").write_text(package_stub(_retrograde))
    (package / "py.typed").touch()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
