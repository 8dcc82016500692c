"""Parses C++ as text: literals, comments, and matching parentheses."""
import re

TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|//[^\n]*|/\*.*?\*/', re.S)
ESCAPES = {"n": "\n", "t": "\t", '"': '"', "\\": "\\"}


def unescape(literal):
    return re.sub(r"\\(.)", lambda m: ESCAPES.get(m.group(1), m.group(1)), literal[1:-1])


def without_comments(text):
    """Comments become spaces; line numbers stay."""
    def blank(match):
        token = match.group(0)
        return re.sub(r"[^\n]", " ", token) if token[0] == "/" else token
    return TOKEN.sub(blank, text)


def closing(text, start):
    """The place of the parenthesis that closes the one at `start`."""
    depth, i = 0, start
    while i < len(text):
        literal = TOKEN.match(text, i)
        if literal:
            i = literal.end()
            continue
        depth += text[i] in "([{"
        depth -= text[i] in ")]}"
        if depth == 0:
            return i
        i += 1
    return len(text)


def arguments(text, start):
    """The texts between the commas of the call whose parenthesis opens at `start`."""
    end, depth, parts, begin, i = closing(text, start), 0, [], start + 1, start + 1
    while i < end:
        literal = TOKEN.match(text, i)
        if literal:
            i = literal.end()
            continue
        depth += text[i] in "([{"
        depth -= text[i] in ")]}"
        if text[i] == "," and depth == 0:
            parts.append(text[begin:i])
            begin = i + 1
        i += 1
    return parts + [text[begin:end]]


def pieces(text):
    """String literals in an expression; neighbours are one."""
    text = re.sub(r'"\s+"', "", text)
    return [unescape(m.group(0)) for m in TOKEN.finditer(text) if m.group(0)[0] == '"']


def one_line(text):
    return " ".join(text.split())
