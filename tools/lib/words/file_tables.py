"""Tables of files in READMEs: the files that a row names exist, and the page names each source file of the folder.

A table of files has `files`, `folder` or the like as its first heading. Its names are relative to the README's folder
or, if the text above the table opens with a sub-folder (`rules/`: ...), to that one. A name may lack the suffix of its
file, and may contain `*`. One name stands for a header and its source; the name of a folder, for all that it contains.
"""
import re

SOURCES = (".h", ".cpp", ".def", ".py", ".cmake")
NAMED = {"file", "files", "folder", "folders", "program", "programs"}
# A page with such a table names every source file of its folder.
COMPLETE = {"file", "files", "folder", "folders"}
WORD = re.compile(r"`([\w./*-]+)`")
SUBFOLDER = re.compile(r"[#\s]*`([\w./-]+/)`")


class FileTable:
    def __init__(self, heading, folder):
        self.is_complete = heading in COMPLETE
        self.folder = folder
        self.names = []  # (line number, name)


def is_name(word):
    """Whether a quoted word may name a file of the folder: not a suffix alone, and nothing outside of the folder."""
    return not word.startswith((".", "/"))


def tables_of(lines, folder):
    """The tables of files in a README of this folder."""
    table, above, previous = None, folder, ""
    for number, line in enumerate(lines, 1):
        if not line.startswith("|"):
            table = None
            subfolder = SUBFOLDER.match(line)
            if line and (line.startswith("#") or not previous):
                is_there = subfolder and (folder / subfolder.group(1)).is_dir()
                above = folder / subfolder.group(1) if is_there else folder
        else:
            cell = line.split("|")[1].strip()
            if not previous.startswith("|") and cell in NAMED:
                table = FileTable(cell, above)
                yield table
            elif table:
                table.names += [(number, name) for name in WORD.findall(cell) if is_name(name)]
        previous = line


def files_of(name, folder):
    """The files and folders that a name stands for."""
    path = folder / name
    if path.exists():
        return [path]
    return [match for pattern in (name, name + ".*") for match in folder.glob(pattern)]


def findings_in_tables(readme, tracked):
    """(line number, finding) for each name without a file, and each tracked source file that the page does not name."""
    text, folder = readme.read_text(), readme.parent
    tables = list(tables_of(text.splitlines(), folder))
    named = [folder / word for word in WORD.findall(text) if is_name(word) and (folder / word).is_file()]
    for table in tables:
        for number, name in table.names:
            files = files_of(name, table.folder)
            named += files
            if not files:
                yield number, f"there is no {name} in {table.folder.relative_to(folder.parent)}/"
    if any(table.is_complete for table in tables):
        units = {unit_of(path) for path in named}
        forgotten = {unit_of(path) for path in sources_of(folder, tracked)
                     if units.isdisjoint({unit_of(path), *path.parents})}
        for unit in sorted(forgotten):
            yield 1, f"does not name {unit.relative_to(folder)}: add it to a table of files"


def unit_of(path):
    """What a header and its source have in common; folders are units of their own."""
    return path if path.is_dir() else path.with_suffix("")


def sources_of(folder, tracked):
    """The source files that the README of the folder describes: those whose nearest README it is. Lists of tests do not
    count."""
    readmes = {path.parent for path in tracked if path.name == "README.md"}
    return [path for path in tracked
            if path.suffix in SOURCES and path.name != "tests.cmake" and next((p for p in path.parents if p in readmes), None) == folder]
