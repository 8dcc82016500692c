#!/usr/bin/env python3
"""make_docs -- writes the comments of the public headers as a table of docstrings for the extension module.

    make_docs.py ROOT OUT.cpp

A header's comment is thereby also the Python docstring. Names and comments are found as in `tools/api_table`.
"""
import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True


def paragraph(lines):
    """Joins the lines of a comment into paragraphs; indented lines (loops, diagrams) stay separate."""
    out = []
    for line in lines:
        joins = out and line and not line.startswith(" ") and out[-1] and not out[-1].startswith(" ")
        if joins:
            out[-1] += " " + line
        else:
            out.append(line)
    return "\n".join(out).strip()


def docstring(reader, name):
    lines = [line for line in reader.raw_comment_above(name.line - 1) if not re.match(r"-{3,}", line)]
    text = paragraph(lines) or reader.comment_behind(name.line - 1) or name.comment
    text = re.sub(r"\s*Requires:\s*", "\n\nRequires: ", text).strip()
    return text if text.endswith((".", ":", ")", "\n")) or not text else text + "."


def as_sentence(text):
    """Capitalises the first word, unless it is a name or the start of code: `x`, `sqrt(...)`."""
    return re.sub(r"^[a-z]{2,}(?=[\s,;:.]|$)", lambda word: word.group(0).capitalize(), text)


def docstrings(root):
    sys.path.insert(0, str(root / "tools/lib"))
    from api.choices import INTERNAL_HEADERS
    from api.headers import HeaderReader, public_headers
    found = {}
    more = ["graph/schedule.h", "graph/function.h", "frontend/data/argument.h", "autodiff/report/explain.h"]
    for header in public_headers(root) + [h for h in more if h not in public_headers(root)]:
        reader = HeaderReader(root, header)
        for name in reader.read():
            text = docstring(reader, name)
            # Keeps the longest comment of all overloads.
            if len(text) > len(found.get(name.full, "")):
                found[name.full] = text
    return found


def literal(text):
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n").replace("?", "\\?")
    return f'"{escaped}"'


def main(root, out):
    rows = "".join(f"    {{{literal(name)}, {literal(text)}}},\n" for name, text in sorted(docstrings(root).items()))
    Path(out).write_text(
        "// Written by python_bindings/tools/make_docs.py from the comments of the headers.\n"
        '#include "docs_table.h"\n\n'
        "namespace retrograde::python {\n\n"
        f"const DocsRow docs_rows[] = {{\n{rows}}};\n"
        "const std::size_t docs_row_count = sizeof(docs_rows) / sizeof(docs_rows[0]);\n\n"
        "}  // namespace retrograde::python\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
