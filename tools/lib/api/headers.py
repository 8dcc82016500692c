"""Public names and requirements: what headers declare, and what their comments say about it.

Names are declarations in namespace retrograde outside of the namespaces of `layer_namespaces.h` and `detail`. A name is
explained by the comment above or behind it, else by the one above its group of lines, else by the header's title.
Requirements follow "Requires:" in comments. Rules are separated by semicolons; the kind of the error is in
parentheses unless it is CompileError:

    // Takes one row. Requires: a crop or slice lies inside the buffer; it must have memory (RuntimeError).
"""
import re

from api.choices import (HEADER_FOLDERS, INTERNAL_HEADERS, INTERNAL_NAMES, INTERNAL_SCOPES, MORE_HEADERS,
                         SHOWN_BY)
from api.cpp_text import TOKEN, closing, one_line, without_comments

HIDDEN_SPACES = {"ir", "simplification", "analysis", "graph", "frontend", "autoschedule", "autodiff", "lower",
                 "checks", "detail", "oracle"}
PREPROCESSOR = re.compile(r"^[ \t]*#(?:.*\\\n)*.*$", re.M)
OPERATOR = re.compile(r"\boperator\s*(\(\)|\[\]|[^\s\w(]+)\s*\(")
SECTION = re.compile(r"-{3,}\s*(.*?)\s*-{3,}$")
REQUIRES = re.compile(r'(?<!")Requires:')
KIND = re.compile(r"\s*\((RuntimeError|Unsupported)\)$")


class Name:
    """A public name: `scope` is the class that it is a member of, or empty."""

    def __init__(self, header, line, scope, name, kind, comment):
        self.header, self.line, self.scope, self.name, self.kind, self.comment = (
            header, line, scope, name, kind, comment)

    @property
    def full(self):
        return f"{self.scope}::{self.name}" if self.scope else self.name

    @property
    def is_public(self):
        if self.scope in INTERNAL_SCOPES or self.full in INTERNAL_SCOPES:
            return False
        return not (INTERNAL_NAMES.fullmatch(self.name)
                    and (self.scope or self.header.startswith("generator")))

    @property
    def word(self):
        """A word that every use of it contains; empty for operators and similar names."""
        words = re.findall(r"\w+", self.name)
        return words[-1] if words and self.kind in ("function", "value", "type", "enum", "concept") else ""

    def owner(self):
        """A pattern for text that shows the class of a member."""
        if not self.scope:
            return None
        return re.compile(SHOWN_BY.get(self.scope, r"\b" + self.scope.split("::")[-1] + r"\b"))

    def use(self):
        """A pattern for its uses."""
        word = re.escape(self.name)
        if self.kind in ("class", "struct", "constructor") and (self.full in SHOWN_BY or self.scope in SHOWN_BY):
            return re.compile(SHOWN_BY.get(self.full) or SHOWN_BY[self.scope])
        if self.kind == "operator":
            return self.use_of_operator()
        if self.kind == "conversion":
            last = self.name[len("operator "):].split("<")[0].strip("& ").split()[-1]
            return re.compile(r"\b" + re.escape(last) + r"\b")
        if self.kind == "function":
            inherited = ("GeneratorBase", "GeneratorPort", "GeneratorInputBase", "GeneratorOutputBase")
            front = (r"\b" if self.scope in inherited else r"(?:\.|->|::)" if self.scope
                     else r"(?<![.>\w])(?:\w+::)?")
            return re.compile(front + word + r"(?:<[^;{}()]*>)?\s*[({]")
        return re.compile(r"\b" + word + r"\b")

    def use_of_operator(self):
        symbol = re.escape(self.name[len("operator"):])
        if self.name == "operator()":
            return re.compile(r"\w\(")
        if self.name == "operator[]":
            return re.compile(r"\w\[")
        is_unary = self.name in ("operator!", "operator~")
        return re.compile(symbol + r"\w" if is_unary else r"[\w)\]]\s" + symbol + r"\s")


class Requirement:
    """One rule of a header, about the declaration at `line`."""

    def __init__(self, header, line, text, kind):
        self.header, self.line, self.text, self.kind = header, line, text, kind
        self.of = ""

    def says(self, rule):
        """Whether this is the rule of a message: the same words, with names and numbers in the gaps."""
        pattern = ".*?".join(re.escape(part) for part in rule.parts)
        return rule.kind == self.kind and re.fullmatch(f".*?{pattern}.*?", self.text) is not None and (
            "…" in rule.text or self.text == rule.text)


# ---- comments ----


def spoken(lines):
    """The first sentence of a comment, without its requirements."""
    words = REQUIRES.split(" ".join(lines))[0].strip()
    if re.match(r"-{3,}", words):
        return ""
    sentence = re.match(r"(.+?[.:;])(?:\s|$)", words + " ")
    return (sentence.group(1) if sentence else words).rstrip(".:;")


def requirements_in(lines):
    """The rules after "Requires:", each with its kind."""
    for said in REQUIRES.split(" ".join(lines))[1:]:
        for item in one_line(said).rstrip(".").split("; "):
            kind = KIND.search(item)
            yield KIND.sub("", item).strip(), kind.group(1) if kind else "CompileError"


class HeaderReader:
    """One pass over a header: namespaces, classes and their public parts. Bodies of functions are skipped."""

    def __init__(self, root, header):
        self.header = header
        self.raw = (root / "compiler" / header).read_text()
        self.lines = self.raw.split("\n")
        self.text = PREPROCESSOR.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), self.raw)
        self.code = without_comments(self.text)
        self.names = []

    def read(self):
        self.scope(0, len(self.code), "", True)
        self.macro_names()
        return self.names

    def scope(self, begin, end, owner, public):
        i = begin
        while i < end:
            i = self.skip_space(i, end)
            if i >= end:
                return
            access = re.compile(r"(public|private|protected)\s*:").match(self.code, i)
            if access and owner:
                public = access.group(1) == "public"
                i = access.end()
                continue
            i = self.declaration(i, end, owner, public)

    def skip_space(self, i, end):
        while i < end and self.code[i] in " \t\n;":
            i += 1
        return i

    def declaration(self, begin, end, owner, public):
        """Reads the declaration that begins here; returns the index after it."""
        i = begin
        while i < end and self.code[i] not in ";{":
            literal = TOKEN.match(self.code, i)
            i = literal.end() if literal else closing(self.code, i) + 1 if self.code[i] in "([" else i + 1
            if self.code[begin:i].strip() in ("}",):
                return i
        head = self.code[begin:i]
        behind = i + 1
        if i < end and self.code[i] == "{":
            behind = closing(self.code, i) + 1
        space = re.match(r"\s*(?:inline\s+)?namespace\s+([\w:]*)", head)
        if space:
            hidden = HIDDEN_SPACES & set(space.group(1).split("::")) or not space.group(1)
            if not hidden:
                self.scope(i + 1, behind - 1, "", True)
            return behind
        if not public:
            return behind
        bare = self.bare(head)
        kind = re.match(r"\s*(class|struct|enum class|enum|union)\s+(?:\[\[\w+\]\]\s*)?(\w+)", bare)
        if kind and i < end and self.code[i] == "{" and not re.search(r"\)\s*(const)?\s*$", bare):
            self.add(kind.group(2), kind.group(1).split()[0], begin, owner)
            full = f"{owner}::{kind.group(2)}" if owner else kind.group(2)
            if kind.group(1) in ("class", "struct"):
                self.scope(i + 1, behind - 1, full, kind.group(1) == "struct")
            return behind
        if re.match(r"\s*(class|struct|enum)\b[^(=]*$", bare):
            return behind  # a forward declaration
        if re.match(r"\s*friend\b(?!.*operator)", bare):
            return behind
        self.name_of(bare, begin, owner)
        # A default member initializer or a lambda in braces may continue to the semicolon.
        return behind

    @staticmethod
    def bare(head):
        """Strips template<...>, requires(...) and attributes from the front."""
        text = head
        while True:
            text = text.lstrip()
            front = re.match(r"template\s*<|requires\s*\(|\[\[|requires\s+requires", text)
            if not front:
                return text
            if front.group(0).startswith("template"):
                depth = 0
                for at, c in enumerate(text[front.end() - 1:]):
                    depth += (c == "<") - (c == ">")
                    if depth == 0:
                        break
                text = text[front.end() - 1 + at + 1:]
            elif front.group(0) == "[[":
                text = text[text.index("]]") + 2:]
            else:
                text = text[closing(text, text.index("(")) + 1:]

    @staticmethod
    def without_angles(text):
        """Removes template arguments; operators with angle brackets were read before."""
        while True:
            shorter = re.sub(r"(?<=\w)<[^<>=]*>", "", text)
            if shorter == text:
                return text
            text = shorter

    def name_of(self, bare, begin, owner):
        operator = OPERATOR.search(bare)
        conversion = None if operator else re.search(r"\boperator\s+([\w:<>&,\s*]+?)\s*\(\s*\)", bare)
        using = re.match(r"using\s+(\w+)\s*=|using\s+[\w:]+::(\w+)\s*$|typedef\b.*\b(\w+)\s*$", bare, re.S)
        if using:
            return self.add(next(g for g in using.groups() if g), "type", begin, owner)
        if operator:
            return self.add("operator" + operator.group(1), "operator", begin, owner)
        if conversion:
            return self.add("operator " + conversion.group(1).strip(), "conversion", begin, owner)
        bare = self.without_angles(bare)
        pointer = re.search(r"\(\*(\w+)\)\s*\(", bare)
        if pointer and bare.index("(") == pointer.start():
            return self.add(pointer.group(1), "value", begin, owner)
        call = re.search(r"(~?\w+)\s*\(", re.sub(r"\b(decltype|noexcept|alignas)\s*\([^()]*\)", "", bare))
        if call and not re.match(r"(static_assert|concept)\b", call.group(1)):
            name = call.group(1)
            if re.match(r"RETROGRADE_\w+$", name) or name.startswith("~"):
                return None
            is_constructor = owner and name == owner.split("::")[-1]
            if "= delete" in bare or (is_constructor and bare.count("&") == 1 and f"const {name}&" in bare):
                return None
            if is_constructor:
                return self.add(name, "constructor", begin, owner)
            if not owner and call.string[:call.start()].endswith("::"):
                return None  # a member that is defined outside its class, which declares it
            return self.add(name, "function", begin, owner)
        concept = re.match(r"concept\s+(\w+)", bare)
        if concept:
            return self.add(concept.group(1), "concept", begin, owner)
        for part in re.sub(r"=[^,]*|\{[^}]*\}|<[^<>]*(?:<[^<>]*>[^<>]*)*>", "", bare).split(","):
            value = re.match(r"(?:.*[\s&*>])?(\w+)\s*(?:=.*)?$", part.strip(), re.S)
            if value and not value.group(1).isdigit() and re.search(r"\s", bare.strip()):
                self.add(value.group(1), "value", begin, owner)

    def macro_names(self):
        """The declarations that a macro of the header makes: RETROGRADE_BIT_OPERATOR(operator&)."""
        for match in re.finditer(r"^[ \t]*RETROGRADE_(\w+)\((.*)\)\s*(?://.*)?$", self.text, re.M):
            if re.match("ERROR|NODE|FIELDS", match.group(1)):
                continue
            for word in match.group(2).split(","):
                word = word.strip()
                if re.match(r"operator\S+$|[a-z]\w*$", word) and word not in ("int", "float"):
                    kind = "operator" if word.startswith("operator") else "function"
                    self.add(word, kind, match.start(), "")
                    break

    def add(self, name, kind, at, owner):
        line = self.code.count("\n", 0, at) + 1
        self.names.append(Name(self.header, line, owner, name, kind, self.explained(line - 1)))

    def explained(self, at):
        """The comment above line `at`, or behind it, or above its group, or the title of the header."""
        own = spoken(self.comment_above(at)) or self.comment_behind(at)
        return own or self.comment_of_group(at) or self.title()

    def title(self):
        """The text after the header's name in its first lines: rdom.h -- reduction domains."""
        begin = next((i for i in range(len(self.lines)) if self.is_comment(i)), 0)
        lines = []
        while self.is_comment(begin + len(lines)) and self.lines[begin + len(lines)].strip() != "//":
            lines.append(self.lines[begin + len(lines)].lstrip()[2:].strip())
        return spoken([re.sub(r"^[\w.]+ -- ", "", " ".join(lines))])

    def is_comment(self, i):
        return 0 <= i < len(self.lines) and self.lines[i].lstrip().startswith("//")

    def comment_above(self, at):
        above, i = [], at - 1
        while self.is_comment(i):
            above.insert(0, self.lines[i].lstrip()[2:].strip())
            i -= 1
        return above

    def raw_comment_above(self, at):
        """The same with the indentation inside of it: loop nests keep their shape."""
        above, i = [], at - 1
        while self.is_comment(i):
            above.insert(0, re.sub(r"^\s*// ?", "", self.lines[i]).rstrip())
            i -= 1
        return above

    def comment_behind(self, at):
        return spoken([self.raw_comment_behind(at)])

    def raw_comment_behind(self, at):
        for line in self.lines[at:at + 6]:
            behind = re.search(r"//\s*(.*)", re.sub(r'"(?:\\.|[^"\\])*"', "", line))
            if behind:
                return behind.group(1)
            if ";" in line or "{" in line:
                break
        return ""

    def comment_of_group(self, at):
        """Lines without an empty one between them are a group; what it begins with speaks for all of it, else
        the title of the section that it is in."""
        i = at
        while i > 0 and self.lines[i - 1].strip():
            i -= 1
        if self.is_comment(i) and not SECTION.search(self.lines[i]):
            end = i
            while self.is_comment(end):
                end += 1
            return spoken(self.comment_above(end))
        while i >= 0 and not re.match(r"(\};|class|struct|enum)\b", self.lines[i]):
            title = SECTION.search(self.lines[i].strip()) if self.is_comment(i) else None
            if title:
                return title.group(1)
            i -= 1
        return ""

    def requirements(self):
        """The requirements of every comment, each for the declaration below it."""
        found, i = [], 0
        while i < len(self.lines):
            if not self.is_comment(i):
                i += 1
                continue
            begin = i
            while self.is_comment(i):
                i += 1
            lines = [line.lstrip()[2:].strip() for line in self.lines[begin:i]]
            found += [Requirement(self.header, i + 1, text, kind) for text, kind in requirements_in(lines)]
        return found


# ---- all headers ----

def public_headers(root):
    folders = [str(path.relative_to(root / "compiler")) for folder in HEADER_FOLDERS
               for path in sorted((root / "compiler" / folder).rglob("*.h"))
               if not {"include", "compat"} & set(path.parts)]
    return [header for header in folders + MORE_HEADERS if header not in INTERNAL_HEADERS]


def read_names(root):
    """Merges overloads to one name; a comment of any of them explains it."""
    merged = {}
    for header in public_headers(root):
        for name in HeaderReader(root, header).read():
            if name.is_public:
                known = merged.setdefault((name.header, name.full), name)
                known.comment = known.comment or name.comment
    return list(merged.values())


def read_requirements(root):
    """The requirements of the public headers, and of the parts of other headers that users see."""
    result = []
    for header in dict.fromkeys(public_headers(root) + sorted(INTERNAL_HEADERS)):
        reader = HeaderReader(root, header)
        names = sorted(reader.read(), key=lambda name: name.line)
        for requirement in reader.requirements():
            below = [name for name in names if name.line >= requirement.line]
            requirement.of = below[0].full if below else ""
            result.append(requirement)
    return result
