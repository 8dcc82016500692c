"""Finds the functions of a C++ or Python source, with their lines."""
import ast
import re

LITERAL = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\b\d[\w\']*|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/'
                     r"|^[ \t]*#(?:\\\n|[^\n])*", re.S | re.M)
TEMPLATE = re.compile(r"template\s*<(?:[^<>]|<(?:[^<>]|<[^<>]*>)*>)*>")
SCOPE = re.compile(r"(inline\s+)?(namespace|class|struct|union|enum)\b|extern\s*$")
LEADING = re.compile(r"\s*((public|protected|private)\s*:\s*)*")
NAME = re.compile(r"((?:[\w~]+::)*(?:operator\W*|[\w~]+))\s*$")


def cpp_functions(text):
    """(name, first line, last line) of each function that a C++ source defines, functions in functions left out."""
    text = LITERAL.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), text)
    begin = 0  # of the declaration at hand
    parameters = None  # where its first parenthesis opens
    depth = 0  # of parentheses, and of the braces in them
    inside = 0  # braces open in the body at hand
    for token in re.finditer(r"[(){};]", text):
        c, at = token.group(0), token.start()
        if inside:
            inside += {"{": 1, "}": -1}.get(c, 0)
            if not inside:
                if parameters is not None:
                    yield named(text, begin, parameters, at)
                begin, parameters = at + 1, None
        elif c in "()" or depth:
            if parameters is None:
                parameters = at
            depth += {"(": 1, "{": 1, ")": -1, "}": -1}.get(c, 0)
        elif c == "{" and not opens_scope(text[begin:at]):
            inside = 1
        else:
            begin, parameters = at + 1, None


def opens_scope(head):
    return SCOPE.match(TEMPLATE.sub("", head[LEADING.match(head).end():]).strip())


def named(text, begin, parameters, end):
    begin = LEADING.match(text, begin).end()
    name = NAME.search(text, begin, parameters)
    line = text.count("\n", 0, begin) + 1
    return name.group(1).strip() if name else "?", line, line + text.count("\n", begin, end)


def python_functions(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.name, node.lineno, node.end_lineno
