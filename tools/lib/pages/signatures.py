"""Public names without a signature in the reference. Sphinx's inventory says where it put each name."""
import ast
import re

from api.headers import public_headers
from sphinx.util.inventory import InventoryFile

from pages.cpp_reference import without_arguments
from pages.doxygen_input import Header
from pages.python_pages import MODULES, listed_names, package_names, read_stub

NO_SIGNATURE = {"cpp:functionParam", "cpp:templateParam"}


def signed_names(site, pages, domain):
    """The names of a domain whose place in the inventory is a signature."""
    with (site / "objects.inv").open("rb") as file:
        inventory = InventoryFile.load(file, "", lambda base, uri: uri)
    places = [(name, place[2]) for kind, entries in inventory.items() for name, place in entries.items()
              if kind.startswith(domain + ":") and kind not in NO_SIGNATURE]
    return {name for name, uri in places if is_signature(site, pages, uri)}


def is_signature(site, pages, uri):
    file, _, anchor = uri.partition("#")
    page = pages.get((site / file).resolve())
    return page is not None and anchor in page.signatures


# ---- C++ ----

def unsigned_cpp_names(root, site, pages):
    known = endings(signed_names(site, pages, "cpp"))
    for path in public_headers(root):
        header = Header(root, path)
        for name in header.names:
            wanted = name.name if is_declared_elsewhere(header, name) else name.full
            if plain(wanted) not in known:
                yield f"{path}:{name.line}: {name.full}"


def endings(names):
    """retrograde::internal::GeneratorPort::name => that, internal::GeneratorPort::name, GeneratorPort::name, name."""
    found = set()
    for name in names:
        parts = plain(name).split("::")
        found |= {"::".join(parts[i:]) for i in range(len(parts))}
    return found


def plain(name):
    return re.sub(r"\s+", "", without_arguments(name))


def is_declared_elsewhere(header, name):
    """A using-declaration, or a member that is defined behind its class."""
    return name.kind == "type" or re.search(rf"\w(<[^<>]*>)?::{re.escape(name.name)}\b", header.head_of(name))


# ---- Python ----

def unsigned_python_names(root, stubs, site, pages):
    known = signed_names(site, pages, "py")
    wanted = [f"retrograde.{name}" for name in members(read_stub(stubs).body)]
    wanted += [f"retrograde.{name}" for name, _ in package_names(root)]
    wanted += [f"{module}.{name}" for module, file in MODULES for name, _ in listed_names(root, file)]
    return [name for name in wanted if name not in known]


def members(body, scope=""):
    """Functions, classes and what is in them, as the stub declares them; an underscore in front hides a name."""
    for node in body:
        name = getattr(node, "name", None) or getattr(getattr(node, "target", None), "id", "_")
        is_variable = isinstance(node, ast.AnnAssign)
        if not name.startswith("_") and (scope or not is_variable):
            yield scope + name
            if isinstance(node, ast.ClassDef):
                yield from members(node.body, f"{scope}{name}.")
