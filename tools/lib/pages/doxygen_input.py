"""The public headers as Doxygen reads them: documentation comments above the names, and no other comments.

Headers have plain comments. The reader of tools/api_table knows which one explains which name; this module writes a
copy of each header with that comment above the name, as reStructuredText that Breathe passes on unchanged.
"""
import re

from api.cpp_text import without_comments
from api.headers import SECTION, HeaderReader

from pages.comments import capitalised, inline, rst_of_comment, sentence


class Header:
    """A public header: its public names, the captions of its sections, and its text for Doxygen."""

    def __init__(self, root, path):
        self.path, self.reader = path, HeaderReader(root, path)
        begin = next(i for i, line in enumerate(self.reader.lines) if line.startswith("namespace retrograde"))
        self.names = [name for name in self.reader.read() if name.is_public and name.line > begin]
        self.original_line = []  # of each line of text(), counted from 1

    @property
    def page(self):
        """Its page in the reference: frontend/language/func.h => frontend_language_func."""
        return re.sub(r"\W", "_", self.path.removesuffix(".h"))

    @property
    def file(self):
        return self.path.split("/")[-1]

    def title(self):
        """What the header says of itself in one sentence."""
        return inline(sentence(self.reader.title()))

    def introduction(self):
        """The comment that opens the header, without the header's name."""
        begin = next(i for i, _ in enumerate(self.reader.lines) if self.reader.is_comment(i))
        end = next(i for i in range(begin, len(self.reader.lines)) if not self.reader.is_comment(i))
        lines = self.reader.raw_comment_above(end)
        first = re.sub(r"^[\w.]+ -- ", "", lines[0])
        return rst_of_comment([capitalised(first), *lines[1:]]) + "\n"

    def section_of(self, line):
        """The caption above a line: `// ---- wrappers ----`."""
        for i in range(line - 1, -1, -1):
            text = self.reader.lines[i]
            caption = SECTION.search(text.strip()) if self.reader.is_comment(i) else None
            if caption:
                return caption.group(1)
            if re.match(r"\};|(class|struct|enum|namespace)\b.*\{", text) and i < line - 1:
                return ""
        return ""

    def concepts(self):
        """(declaration, explanation as reStructuredText): Breathe knows none."""
        for name in self.names:
            if name.kind == "concept":
                template = re.search(rf"(template\s*<[^{{}};]*>)\s*concept\s+{name.name}\b", self.reader.code)
                yield f"{template.group(1)} {name.name}", rst_of_comment(self.own_comment(name))

    def head_of(self, name):
        """The first line of its declaration."""
        return self.reader.lines[name.line - 1]

    def text(self):
        above, out = self.explanations(), []
        for number, code in enumerate(without_comments(self.reader.raw).split("\n"), 1):
            lines = [*above.get(number, "").split("\n"), code] if number in above else [code]
            out += lines
            self.original_line += [number] * len(lines)
        return "\n".join(out)

    def explanations(self):
        """Documentation comments by the line that they go above. Of overloads the first keeps a group's comment."""
        above, explained = {}, set()
        for name in self.names:
            lines = self.own_comment(name)
            if not lines and name.full not in explained:
                lines = [sentence(self.reader.comment_of_group(name.line - 1))]
            body = rst_of_comment(lines).replace("*/", "* /")
            if body:
                above[name.line] = f"/** \\verbatim embed:rst\n{body}\n\\endverbatim */"
                explained.add(name.full)
        return above

    def own_comment(self, name):
        lines = [line for line in self.reader.raw_comment_above(name.line - 1) if not SECTION.search(line)]
        return lines or [sentence(self.reader.raw_comment_behind(name.line - 1))]
