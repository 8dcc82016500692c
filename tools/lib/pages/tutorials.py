"""The tutorials as pages: what the program says of itself, its picture, and its code, cut at the captions in it."""
import re

from pages.comments import rst_of_comment
from pages.writing import heading, toctree

CAPTION = re.compile(r"\s*(?://|#) ---- (.*?) ----\s*$")
# Folders of test/tutorials, and the folder with pictures of the same names.
FOLDERS = {"": None, "gradients": "gradients", "gpu": "gpu", "python": None, "python/gradients": "gradients"}
HELPERS = {"claims.py", "compare.py"}


def write_tutorials(root, work):
    """A page for each program, and under the README of each folder the list of its pages."""
    for folder, pictures in FOLDERS.items():
        programs = programs_in(root / "test/tutorials" / folder)
        for program in programs:
            write_page(root, work, program, pictures)
        append_list(root, work, folder, programs)


def programs_in(folder):
    """In the order in which the README names them."""
    readme = folder / "README.md" if (folder / "README.md").exists() else folder.parent.parent / "gradients/README.md"
    order = readme.read_text()
    found = [path for path in folder.iterdir() if path.suffix in (".cpp", ".py") and path.name not in HELPERS]
    places = {path: order.find(f"`{path.stem}") for path in found}
    return sorted(found, key=lambda path: (places[path] < 0, places[path], path.name))


def append_list(root, work, folder, programs):
    """The README of python/ lists the gradients in Python, too."""
    readme = "python" if folder.startswith("python") else folder
    name = "/".join(part for part in ("test/tutorials", readme, "README") if part)
    caption = "Gradients in Python" if folder == "python/gradients" else "The programs"
    entries = [f"/{page_name(root, program)}" for program in programs]
    path = work / "appended" / f"{name}.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as out:
        out.write(f"\n## {caption}\n\n```{{eval-rst}}\n{toctree(entries)}```\n")


def page_name(root, program):
    return f"tutorials/{program.relative_to(root / 'test/tutorials').with_suffix('')}"


# ---- one page ----

def write_page(root, work, program, pictures):
    lines = program.read_text().splitlines()
    end, comment = opening_comment(lines)
    source = "/" + str(program.relative_to(root))
    parts = [heading(program.stem.replace("_", " ").capitalize(), "="), rst_of_comment(comment),
             picture(root, program, pictures),
             f"\nThe program: :download:`{program.name} <{source}>`{twin(root, program)}\n"]
    parts += [code(source, *part) for part in parts_of(lines, end)]
    path = work / f"{page_name(root, program)}.rst"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(parts))


def opening_comment(lines):
    """The number of its lines, and its text: `//` in C++, a docstring in Python."""
    if lines[0].startswith('"""'):
        end = next(i for i, line in enumerate(lines) if line.endswith('"""') and (i or line.count('"""') == 2))
        return end + 1, [line.replace('"""', "") for line in lines[:end + 1]]
    mark = "//" if lines[0].startswith("//") else "#"
    end = next(i for i, line in enumerate(lines) if not line.startswith(mark))
    return end, [re.sub(f"^{mark}!?[^ ]*? ?", "", line) for line in lines[:end]]


def picture(root, program, folder):
    name = f"test/tutorials/{folder}/pictures/{program.stem}.svg"
    return f"\n.. image:: /{name}\n   :alt: what the program draws\n" if folder and (root / name).exists() else ""


def twin(root, program):
    """A link to the same program in the other language."""
    folder = root / "test/tutorials"
    name = str(program.relative_to(folder).with_suffix(""))
    is_python = program.suffix == ".py"
    other = name.removeprefix("python/") if is_python else f"python/{name}"
    if not (folder / other).with_suffix(".cpp" if is_python else ".py").exists():
        return ""
    return f". The same :doc:`in {'C++' if is_python else 'Python'} </tutorials/{other}>`."


def parts_of(lines, begin):
    """(caption, first line, last line), lines counted from 1; lines under a caption of theirs."""
    starts = [begin] + [i for i, line in enumerate(lines) if CAPTION.match(line)]
    for start, end in zip(starts, [*starts[1:], len(lines)]):
        caption = CAPTION.match(lines[start])
        first = start + 1 if caption else start
        if any(line.strip() for line in lines[first:end]):
            yield caption.group(1).rstrip(".") if caption else "", first + 1, end


def code(source, caption, first, last):
    title = heading(rst_of_comment([caption]), "-") if caption else ""
    language = "python" if source.endswith(".py") else "cpp"
    return (f"{title}\n.. literalinclude:: {source}\n   :language: {language}\n   :lines: {first}-{last}\n"
            f"   :dedent:\n")
