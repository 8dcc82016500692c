"""Every public name of the C++ library has its like in the package, or stands in python_bindings/unbound.md with the
reason; that list holds nothing else. And what is bound says what it is."""
import fnmatch
import inspect
import re
import sys
import unittest
from pathlib import Path

import retrograde as rg

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True
from api.headers import read_names  # noqa: E402

OPERATORS = {"+": "__add__", "-": "__sub__", "*": "__mul__", "/": "__truediv__", "%": "__mod__", "<": "__lt__",
             "<=": "__le__", ">": "__gt__", ">=": "__ge__", "==": "__eq__", "!=": "__ne__", "&": "__and__",
             "|": "__or__", "^": "__xor__", "~": "__invert__", "<<": "__lshift__", ">>": "__rshift__",
             "!": "__invert__", "&&": "__and__", "||": "__or__", "()": "__call__", "[]": "__getitem__",
             "+=": "__add__", "-=": "__sub__", "*=": "__mul__", "/=": "__truediv__", "=": "__setitem__", "<=>": "__lt__"}
WORDS = {"in": "in_", "lambda": "lambda_", "async": "async_", "pass": "pass_"}
# Base classes that Python does not expose: the classes that have their members instead.
BASES = {"LoopDirectives": ["Func", "Stage"], "Runnable": ["Func", "Pipeline"], "OutputImageParam": ["OutputImageParam"]}
FREE = ["", "BoundaryConditions"]  # where functions may be


def python_name(name):
    if name.startswith("operator") and not name.startswith("operator "):
        return OPERATORS[name[len("operator"):]]
    return WORDS.get(name, name)


def found(path):
    thing = rg
    for part in path:
        if not hasattr(thing, part):
            return False
        thing = getattr(thing, part)
    return True


def is_bound(name):
    scope = name.scope.split("::") if name.scope else []
    if name.kind == "conversion" or (scope and name.name == scope[-1]):
        return found(scope) or scope[-1] in BASES  # conversions are those of arguments
    own = python_name(name.name)
    if not scope:
        return own.startswith("__") or any(found([p for p in (place, own) if p]) for place in FREE) or own in BASES
    if scope[-1] in BASES:
        return all(found([cls, own]) for cls in BASES[scope[-1]])
    return found(scope + [own])


def reasons():
    """The patterns of unbound.md: | `Buffer::begin` `Buffer::end` | why |"""
    rows = re.findall(r"^\| ((?:`[^`]+` ?)+)\| (.+) \|$", (ROOT / "python_bindings/unbound.md").read_text(), re.M)
    return [(pattern, why) for patterns, why in rows for pattern in re.findall("`([^`]+)`", patterns)]


class Names(unittest.TestCase):
    maxDiff = None

    def test_each_is_bound_or_has_its_reason(self):
        unbound = {name.full for name in read_names(ROOT) if not is_bound(name)}
        patterns = [pattern for pattern, why in reasons()]
        left = sorted(n for n in unbound if not any(fnmatch.fnmatchcase(n, p) for p in patterns))
        self.assertEqual(left, [], "bind them, or say in python_bindings/unbound.md why not")
        stale = [p for p in patterns if not any(fnmatch.fnmatchcase(n, p) for n in unbound)]
        self.assertEqual(stale, [], "nothing of the kind is unbound")
        self.assertTrue(all(len(why) > 10 for pattern, why in reasons()))


class HalidesNames(unittest.TestCase):
    def test_that_differ_from_those_of_its_cpp(self):
        self.assertIs(rg.TargetArch, rg.Target.Arch)
        self.assertIs(rg.TargetOS.Linux, rg.Target.OS.Linux)
        self.assertIs(rg.TargetFeature.AVX2, rg.Target.Feature.AVX2)
        self.assertIs(rg.ArgumentKind, rg.Argument.Kind)
        with self.assertRaises(rg.HalideError):
            rg.Func("undefined").realize([3])


class Docstrings(unittest.TestCase):
    def test_come_from_the_headers(self):
        self.assertIn("gradient", rg.propagate_adjoints.__doc__)
        for of in (rg.Func.compute_at, rg.Func.vectorize, rg.Buffer.copy_from, rg.check_gradients, rg.Pipeline,
                   rg.custom_adjoint, rg.AutoscheduleOptions, rg.Module.compile):
            self.assertGreater(len(re.sub(r"\w+\(.*\) -> .*", "", of.__doc__).strip()), 30, of)

    def test_of_most_methods(self):
        said = total = 0
        for _, cls in inspect.getmembers(rg, inspect.isclass):
            for name, method in vars(cls).items():
                if name.startswith("_") or not callable(method):
                    continue
                total += 1
                text = re.sub(r"\w+\(.*?\) -> [^\n]*|\*args|\d+\.|Overloaded function\.", "", method.__doc__ or "")
                said += len(text.strip()) > 10
        self.assertGreater(said / total, 0.75)


if __name__ == "__main__":
    unittest.main()
