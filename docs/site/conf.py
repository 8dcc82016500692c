"""How Sphinx builds the documentation site. `tools/docs` prepares the folder of sources and runs it; see there.

The sources are links to the repository's folders, beside pages that are written anew at every build (reference/,
tutorials/, gallery.md). So a relative link between two pages is right in the repository and on the site.
"""
import os
import re
import sys
from pathlib import Path

sources = Path(os.environ["SITE_SOURCES"])
sys.path[:0] = [os.environ["SITE_TOOLS"], str(sources / "python")]

from sphinx.domains.cpp import ASTDeclaration  # noqa: E402
from sphinx.ext.autodoc.mock import _MockModule  # noqa: E402

from api.headers import HeaderReader, public_headers  # noqa: E402
from pages.comments import rst_of_comment, sentence  # noqa: E402

project = "Retrograde"
author = "the authors of Retrograde"
release = os.environ["SITE_VERSION"]
copyright = f"{author}, MIT licence"

extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc", "sphinx_copybutton"]
root_doc = "index"
include_patterns = [
    "index.md", "gallery.md", "folders.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "python_bindings/*.md",
    "*/README.md", "*/*/README.md", "*/*/*/README.md", "tutorials/**", "reference/**"]
exclude_patterns = ["appended/**"]  # what prepare_page() adds to others
nitpicky = False  # signatures name types of the standard library, which have no page

# ---- Markdown ----
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3  # links to headings, as repositories show them

# ---- C++: the XML that tools/lib/pages/cpp_reference.py writes ----
breathe_projects = {"retrograde": str(sources / "xml")}
breathe_default_project = "retrograde"
breathe_show_include = False
cpp_maximum_signature_line_length = 100

def remember_ids():
    """Sphinx 5 makes the mangled name of every candidate again for every reference: a third of the time."""
    newest_id = ASTDeclaration.get_newest_id

    def remembered(declaration):
        if getattr(declaration, "remembered_id", None) is None:
            declaration.remembered_id = newest_id(declaration)
        return declaration.remembered_id
    ASTDeclaration.get_newest_id = remembered


remember_ids()

# ---- Python: the stubs and modules that tools/lib/pages/python_package.py writes ----
autodoc_mock_imports = ["numpy", "torch"]
_MockModule.__version__ = "2.0"  # retrograde.torch asks torch for it
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
add_module_names = False
toc_object_entries = False  # the list beside a page names its classes

# ---- appearance ----
html_theme = "furo"
html_title = f"Retrograde {release}"
html_static_path = [str(Path(__file__).parent / "static")]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#8a3b12", "color-brand-content": "#a04a18"},
    "dark_css_variables": {"color-brand-primary": "#f0a070", "color-brand-content": "#f0a070"},
}
pygments_style = "friendly"
pygments_dark_style = "monokai"


TITLES = {HeaderReader(sources, header).title() for header in public_headers(sources)}


def comment_as_text(app, what, name, obj, options, lines):
    """Docstrings of the stubs are comments of the headers; what has none has the title of its header, which is not
    shown again for each name."""
    text = "\n".join(lines).strip()
    if text.rstrip(".") in TITLES and what != "class":
        text = ""
    lines[:] = rst_of_comment((text if "\n" in text else sentence(text)).split("\n")).split("\n")


def page_of_link(docname, link):
    """README.md of the repository is the home page; a folder's page is its README, or that of a folder around it."""
    folder = (sources / docname).parent
    if os.path.normpath(folder / link) == str(sources / "README.md"):
        return link[:-len("README.md")] + "index.md"
    if not (folder / link).is_dir():
        return link
    return f"{link}/README.md" if (folder / link / "README.md").exists() else page_of_link(docname, f"{link}/..")


def prepare_page(app, docname, source):
    """The READMEs of tutorials list their programs."""
    source[0] = re.sub(r"\]\(([\w./-]+)(?=[#)])", lambda match: f"]({page_of_link(docname, match[1])}", source[0])
    appended = sources / "appended" / f"{docname}.md"
    if appended.exists():
        source[0] += appended.read_text()


def setup(app):
    app.connect("autodoc-process-docstring", comment_as_text)
    app.connect("source-read", prepare_page)
