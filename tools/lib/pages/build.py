"""Builds the documentation site: prepares a folder of sources, then runs Sphinx on it.

    build.py ROOT STUBS OUTPUT      as tools/docs calls it
"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.dont_write_bytecode = True

from api.headers import public_headers  # noqa: E402

from pages.cpp_pages import write_cpp_pages  # noqa: E402
from pages.cpp_reference import Reference, run_doxygen  # noqa: E402
from pages.doxygen_input import Header  # noqa: E402
from pages.gallery import write_gallery  # noqa: E402
from pages.python_package import write_python_package  # noqa: E402
from pages.python_pages import write_python_pages  # noqa: E402
from pages.tutorials import write_tutorials  # noqa: E402

# Folders and files that pages link to: the folder of sources has all of them, as the repository has.
LINKED = ["apps", "bench", "cmake", "compiler", "docs", "python_bindings", "runtime", "test", "tools",
          "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "README.md"]


def build(root, stubs, output):
    """The site of the repository at `root` in the folder `output`; gives Sphinx's exit status."""
    work = output.parent / (output.name + "-sources")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    link_repository(root, work)
    write_reference(root, stubs, work)
    write_tutorials(root, work)
    write_gallery(root, work)
    return run_sphinx(root, work, output)


def link_repository(root, work):
    for name in LINKED:
        (work / name).symlink_to(root / name)
    for page in ("index.md", "folders.md"):
        (work / page).symlink_to(root / "docs/site" / page)


def write_reference(root, stubs, work):
    headers = [Header(root, path) for path in public_headers(root)]
    contents = Reference(headers, run_doxygen(root, work, headers), work / "xml").write()
    write_cpp_pages(work / "reference/cpp", headers, contents)
    write_python_package(root, stubs, work / "python")
    write_python_pages(root, work / "reference/python", stubs, headers)


def version(root):
    return re.search(r"project\(retrograde VERSION (\S+)", (root / "CMakeLists.txt").read_text()).group(1)


def run_sphinx(root, work, output):
    """Anew, so that no page of an earlier build stays; warnings are errors. In one process: Sphinx cannot merge what
    several have read of partial specialisations."""
    shutil.rmtree(output, ignore_errors=True)
    environment = {**os.environ, "SITE_SOURCES": str(work), "SITE_TOOLS": str(root / "tools/lib"),
                   "SITE_VERSION": version(root), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", "-c", root / "docs/site",
               "-d", work / "doctrees", work, output]
    return subprocess.run(command, env=environment).returncode


if __name__ == "__main__":
    sys.exit(build(*(Path(argument).resolve() for argument in sys.argv[1:4])))
