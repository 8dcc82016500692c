"""Finds the functions and classes of a C++ or Python source, with their lines."""
import ast
import re

LITERAL = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\b\d[\w\']*|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/'
                     r"|^[ \t]*#(?:\\\n|[^\n])*", re.S | re.M)
TEMPLATE = re.compile(r"template\s*<(?:[^<>]|<(?:[^<>]|<[^<>]*>)*>)*>")
CLASS = re.compile(r"(?:class|struct|union)\b((?:alignas\([^()]*\)|::|[^:=()])*)(?::.*)?", re.S)
CLASS_NAME = re.compile(r"([\w:]+)\s*(<.*)?(\bfinal\s*)?$", re.S)
SCOPE = re.compile(r"(inline\s+)?(namespace|class|struct|union|enum)\b|extern\s*$")
LEADING = re.compile(r"\s*((public|protected|private)\s*:\s*)*")
NAME = re.compile(r"((?:[\w~]+::)*(?:operator\W*|[\w~]+))\s*$")


def cpp_functions(text):
    """(name, first line, last line) of each function that a C++ source defines, functions in functions left out."""
    text = blanked_literals(text)
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


def cpp_classes(text):
    """(name, first line, last line) of each class, struct and union that a C++ source defines, also inside others."""
    text = blanked_literals(text)
    begin = 0  # of the declaration at hand
    open_braces = []  # for each, where its declaration begins and the name of the class that it defines, or None
    for token in re.finditer(r"[{};]", text):
        if token.group(0) == "{":
            open_braces.append((begin, class_name(text[begin:token.start()])))
        elif token.group(0) == "}" and open_braces:
            first, name = open_braces.pop()
            if name:
                yield name, *lines(text, first, token.start())
        begin = token.end()


def blanked_literals(text):
    return LITERAL.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), text)


def declaration(head):
    return TEMPLATE.sub("", head[LEADING.match(head).end():]).strip()


def opens_scope(head):
    return SCOPE.match(declaration(head))


def class_name(head):
    """The name of the class whose members follow `head`; None if they are no members of a class."""
    match = CLASS.fullmatch(declaration(head))
    if not match:
        return None
    name = CLASS_NAME.search(match.group(1))
    return name.group(1) if name else "?"


def named(text, begin, parameters, end):
    name = NAME.search(text, LEADING.match(text, begin).end(), parameters)
    return name.group(1).strip() if name else "?", *lines(text, begin, end)


def lines(text, begin, end):
    """The first and last line of the declaration in this part of the text."""
    begin = LEADING.match(text, begin).end()
    line = text.count("\n", 0, begin) + 1
    return line, line + text.count("\n", begin, end)


def python_functions(text):
    return python_definitions(text, ast.FunctionDef, ast.AsyncFunctionDef)


def python_classes(text):
    return python_definitions(text, ast.ClassDef)


def python_definitions(text, *kinds):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, kinds):
            yield node.name, node.lineno, node.end_lineno
