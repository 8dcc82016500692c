"""The pages of the Python reference: the topics of the C++ reference, and what Python has beyond it."""
import ast

from pages.cpp_pages import TOPICS, topic_of
from pages.writing import heading, slug, toctree

OPENING = """
The names of the C++ library, as Python calls them; :doc:`/python_bindings/README` says what differs. ``ExprLike``,
``TypeLike`` and their like in signatures are what an argument takes beyond its class: numbers, texts, arrays of NumPy.
"""
PACKAGE = "Generators, errors and files in Python"
# The modules written in Python: the name, and the file with its __all__.
MODULES = [
    ("retrograde.runtime", "runtime.py"),
    ("retrograde.torch", "torch/__init__.py"),
    ("retrograde.imageio", "imageio.py")]
PACKAGE_FILES = ["_generator.py", "_linking.py", "_names.py", "_command_line.py", "_errors.py"]


# ---- which names there are ----

def read_stub(stubs):
    return ast.parse((stubs / "retrograde/_retrograde.pyi").read_text())


def stub_names(stubs):
    """(name, is a class) of what the extension module gives; an underscore in front hides a name."""
    named = [node for node in read_stub(stubs).body if isinstance(node, (ast.ClassDef, ast.FunctionDef))]
    names = {node.name: isinstance(node, ast.ClassDef) for node in named if not node.name.startswith("_")}
    return sorted(names.items())


def listed_names(root, file):
    """(name, is a class) of the functions and classes that a module written in Python has in its __all__."""
    tree = ast.parse((root / "python_bindings/retrograde" / file).read_text())
    public = next((ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)
                   and getattr(node.targets[0], "id", "") == "__all__"), None)
    defined = {node.name: isinstance(node, ast.ClassDef) for node in ast.walk(tree)
               if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node in tree.body}
    imported = {alias.name: alias.name[0].isupper() for node in tree.body if isinstance(node, ast.ImportFrom)
                for alias in node.names}
    found = {**imported, **defined} if public else defined
    return [(name, found[name]) for name in public or defined
            if name in found and not name.startswith("_") and not name.isupper()]


def package_names(root):
    return [pair for file in PACKAGE_FILES for pair in listed_names(root, file) if pair[0] != "error"]


def topics_of_names(headers):
    """Where the C++ library declares a name."""
    return {name.name: topic_of(header.path) for header in headers for name in header.names if not name.scope}


# ---- pages ----

def write_python_pages(root, folder, stubs, headers):
    folder.mkdir(parents=True, exist_ok=True)
    topics, pages = topics_of_names(headers), {}
    for name, is_class in stub_names(stubs):
        pages.setdefault(topics.get(name, "More names"), []).append((name, is_class))
    pages[PACKAGE] = package_names(root)
    order = [title for title in [*dict(TOPICS), "More names", PACKAGE] if title in pages]
    for title in order:
        (folder / f"{slug(title)}.rst").write_text(page(title, "retrograde", pages[title]))
    for module, file in MODULES:
        (folder / f"{slug(module)}.rst").write_text(module_page(module, listed_names(root, file)))
    entries = [slug(title) for title in order] + [slug(module) for module, _ in MODULES]
    (folder / "index.rst").write_text(heading("Python reference", "=") + OPENING + toctree(entries))


def module_page(module, names):
    return page(module, module, names, f".. automodule:: {module}\n")


def page(title, module, names, opening=""):
    functions = [name for name, is_class in names if not is_class]
    parts = [heading(title, "="), opening, f".. currentmodule:: {module}\n"]
    parts += [class_section(name) for name, is_class in names if is_class]
    if functions:
        parts += [heading("Functions", "-"), *(f".. autofunction:: {name}\n" for name in functions)]
    return "\n".join(parts)


def class_section(name):
    return heading(name, "-") + f"\n.. autoclass:: {name}\n   :members:\n   :undoc-members:\n"
