"""Small pieces of reStructuredText."""
import re


def heading(text, line):
    return f"{text}\n{line * len(text)}\n"


def slug(title):
    """The page of a title: Running and compiling => running_and_compiling."""
    return re.sub(r"\W+", "_", title.lower()).strip("_")


def toctree(entries, hidden=False, depth=1):
    options = "   :hidden:\n" if hidden else f"   :maxdepth: {depth}\n"
    return f"\n.. toctree::\n{options}\n" + "".join(f"   {entry}\n" for entry in entries)
