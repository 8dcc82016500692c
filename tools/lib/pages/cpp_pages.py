"""The pages of the C++ reference: one for each public header, listed by topic."""
import textwrap

from pages.comments import capitalised, inline, sentence
from pages.writing import heading, slug, toctree

TOPICS = [
    ("The language", "frontend/language/"), ("Buffers, images and parameters", "frontend/data/"),
    ("Schedules", "frontend/schedule/"), ("Running and compiling", "frontend/run/"),
    ("Gradients", "autodiff/"), ("Checks of gradients", "checks/"), ("Generators", "generator/"),
    ("Expressions, types and targets", "ir/"), ("Errors and observers", "diagnostics/"),
    ("Schedules as files", "graph/")]
OPENING = """
Programs include ``<retrograde/retrograde.h>``, which holds all of this, in ``namespace retrograde``. Each page shows
the names of one header with their signatures. "Requires" lists rules; breaking one throws ``CompileError``, or the kind
of error in parentheses behind it. :doc:`/docs/api` names the test of every name and rule.
"""


def topic_of(header):
    """The title of the topic that a header belongs to."""
    return next(title for title, folder in TOPICS if header.startswith(folder))


def write_cpp_pages(folder, headers, contents):
    """`contents`: for each header its classes and its groups, as cpp_reference.Reference.write gives them."""
    folder.mkdir(parents=True, exist_ok=True)
    shown = [header for header in headers if any(contents[header.path])]
    for header in shown:
        (folder / f"{header.page}.rst").write_text(page(header, *contents[header.path]))
    for topic, _ in TOPICS:
        (folder / f"{slug(topic)}.rst").write_text(topic_page(topic, shown))
    listed = toctree([slug(topic) for topic, _ in TOPICS], depth=2)
    (folder / "index.rst").write_text(heading("C++ reference", "=") + OPENING + listed)


def topic_page(topic, headers):
    mine = [header for header in headers if topic_of(header.path) == topic]
    rows = [f":doc:`{header.file} <{header.page}>`\n   {header.title()}" for header in mine]
    entries = [f"{header.file} <{header.page}>" for header in mine]
    return heading(topic, "=") + "\n" + "\n".join(rows) + "\n\n" + toctree(entries, hidden=True)


def page(header, classes, groups):
    parts = [heading(header.file, "="), header.introduction(), ".. cpp:namespace:: retrograde\n"]
    parts += [class_section(kind, name) for kind, name in classes]
    parts += [group_section(caption, group, bool(classes)) for caption, group in groups]
    parts += [concept_section(*concept) for concept in header.concepts()]
    return "\n".join(parts)


def class_section(kind, name):
    return heading(inline(name), "-") + f"\n.. doxygen{kind}:: {name}\n   :members:\n   :undoc-members:\n"


def concept_section(declaration, text):
    return f"\n.. cpp:concept:: {declaration}\n\n" + textwrap.indent(text, "   ") + "\n"


def group_section(caption, group, follows_classes):
    title, _, text = caption.partition(": ")
    title = capitalised(title) or ("Functions and types" if follows_classes else "Names")
    text = f"\n{inline(sentence(text))}\n" if text else ""
    directive = f"\n.. doxygengroup:: {group}\n   :content-only:\n   :members:\n   :undoc-members:\n"
    return heading(inline(title), "-") + text + directive
