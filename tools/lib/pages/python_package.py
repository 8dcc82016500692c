"""The Python package as autodoc imports it: the modules written in Python, and the stubs in place of the extension.

The extension module itself is not loaded, so that a site can be built where its library cannot run. Its stub becomes a
module that executes: base classes first, annotations as text, and overloads that keep the documentation of all of them.
"""
import ast
import shutil

HEAD = '''\
from __future__ import annotations

from inspect import cleandoc
from typing import overload

_documentation = {}


def overload(function):  # autodoc reads the signatures of overloads; this gives the last one the texts of all
    texts = _documentation.setdefault(function.__qualname__, [])
    text = cleandoc(function.__doc__ or "")
    if text and text not in texts:
        texts.append(text)
    function.__doc__ = "\\n\\n".join(texts)
    return function


'''
TAIL = '''

def _belongs_to_the_package(members):
    for value in members:
        if isinstance(value, type):
            value.__module__ = "retrograde"
            _belongs_to_the_package(vars(value).values())


_belongs_to_the_package(list(globals().values()))
__version__ = ""
del annotations, cleandoc, overload
'''


def write_python_package(root, stubs, folder):
    """`stubs`: the folder that holds retrograde/_retrograde.pyi."""
    package = folder / "retrograde"
    shutil.copytree(root / "python_bindings/retrograde", package, dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns("*.pyi", "compat", "__pycache__"))
    stub = (stubs / "retrograde/_retrograde.pyi").read_text()
    (package / "_retrograde.py").write_text(module_of_stub(stub))


def module_of_stub(text):
    """The parts of the stub in an order in which they execute."""
    tree = ast.parse(text)
    kept = [node for node in tree.body if not isinstance(node, (ast.Import, ast.ImportFrom)) and not is_alias(node)]
    classes = {node.name: node for node in kept if isinstance(node, ast.ClassDef)}
    rest = [node for node in kept if not isinstance(node, ast.ClassDef)]
    ordered = bases_first(classes) + rest
    return HEAD + "\n\n".join(executable(ast.get_source_segment(text, node), node)
                              for node in ordered) + TAIL


def is_alias(node):
    """ExprLike = Union[...]: signatures show the name."""
    return isinstance(node, ast.Assign) and node.targets[0].id.endswith("Like") or isinstance(node, ast.Expr)


def bases_first(classes):
    done = {}

    def visit(node):
        for base in node.bases:
            if isinstance(base, ast.Name) and base.id in classes:
                visit(classes[base.id])
        done[node.name] = node

    for node in classes.values():
        if node.name not in done:
            visit(node)
    return list(done.values())


def executable(source, node):
    """With decorators; a name that has a type alone gets the value None."""
    decorators = "".join(f"@{ast.unparse(decorator)}\n" for decorator in getattr(node, "decorator_list", []))
    is_bare = isinstance(node, ast.AnnAssign) and node.value is None
    return decorators + source + (" = None" if is_bare else "")
