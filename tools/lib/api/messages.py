"""Rules: the second part of every message that the compiler raises."""
import re

from api.cpp_text import TOKEN, arguments, one_line, pieces, unescape, without_comments

FOLDERS = ["graph", "frontend", "generator", "transform", "driver", "autodiff", "checks", "lower", "ir", "jit", "aot"]
# IR text is for tools and tests; its errors are one rule per position in a text.
INTERNAL_FILES = {"ir/lexer.cpp", "ir/parse_expr.cpp"}
# Functions that raise an error: the index of the rule among their arguments, and the kind of error.
RAISERS = {"user_error": (1, "CompileError"), "call_error": (1, "RuntimeError"),
           "unsupported": (1, "Unsupported"), "type_error": (1, "CompileError"),
           "literal_in": (3, "CompileError")}
# A class's own `refuse` adds the subject; the rule is its second argument.
RAISERS_OF_GENERATORS = {"refuse": (1, "CompileError"), **RAISERS}


class Rule:
    """`text`: the message's literals, with an ellipsis for whatever is between them."""

    def __init__(self, root, path, line, kind, text, literals):
        self.file = str(path.relative_to(root / "compiler"))
        self.line, self.kind, self.text, self.literals = line, kind, text, literals

    @property
    def parts(self):
        return [part for part in map(str.strip, self.text.split("…")) if part]


def rule_text(argument):
    argument = re.sub(r'"\s+"', "", argument.strip())
    out, last = "", 0
    for m in TOKEN.finditer(argument):
        if m.group(0)[0] != '"':
            continue
        if argument[last:m.start()].strip(" \n(,+)") not in ("", "text", "std::string"):
            out += "…"
        out += unescape(m.group(0))
        last = m.end()
    if argument[last:].strip(" \n(,+)"):
        out += "…"
    return one_line(out)


def said_before(text, place, argument):
    """A rule that has a name: what the last `const std::string rule = ...;` before says."""
    name = argument.strip()
    if not re.fullmatch(r"\w+", name):
        return argument
    found = None
    for found in re.finditer(r"std::string\s+" + name + r"\s*=\s*([^;]*);", text[:place]):
        pass
    return found.group(1) if found else argument


def rules_of_file(root, path):
    text = without_comments(path.read_text())
    is_generator = path.parent.name == "generator"
    raisers = RAISERS_OF_GENERATORS if is_generator else RAISERS
    for m in re.finditer(r"\b(" + "|".join(raisers) + r")\s*\(", text):
        before = text[:m.start()].rsplit("\n", 1)[-1]
        if re.search(r"\b(void|Expr)\s+([\w:]+::)?$", before):
            continue  # a declaration
        args = arguments(text, m.end() - 1)
        at, kind = raisers[m.group(1)]
        if len(args) <= at:
            continue
        said = rule_text(said_before(text, m.start(), args[at]))
        if said.strip("… "):
            line = text.count("\n", 0, m.start()) + 1
            yield Rule(root, path, line, kind, said, [p for a in args for p in pieces(a)])


def read_rules(root):
    rules = []
    for folder in FOLDERS:
        for path in sorted((root / "compiler" / folder).rglob("*")):
            if path.suffix in (".cpp", ".h") and str(path.relative_to(root / "compiler")) not in INTERNAL_FILES:
                rules += rules_of_file(root, path)
    return rules
