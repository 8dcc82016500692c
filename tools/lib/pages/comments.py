"""Plain comments as reStructuredText: paragraphs, code where lines are indented, and requirements as a list."""
import re

from api.cpp_text import one_line
from api.headers import REQUIRES

CODE = re.compile(r"\s{2,}\S|.*[=(].*;(\s*//.*)?$|\s*//")
SPECIAL = re.compile(r"([\\*_|`])")


def capitalised(text):
    return text[:1].upper() + text[1:]


def sentence(text):
    """A caption as a sentence: `how many Buffers` => `How many Buffers.`; code stays: `f(_) = e`."""
    if not re.match(r"[A-Za-z][a-z]*([ ,:;.]|$)", text):
        return text
    return capitalised(text) + ("" if text[-1] in ".:;!?" else ".")


def inline(text):
    """Words between backticks are code; elsewhere no character has a meaning."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return SPECIAL.sub(r"\\\1", text)
    return "".join(f"``{part}``" if i % 2 and part.strip() else SPECIAL.sub(r"\\\1", part)
                   for i, part in enumerate(parts))


def blocks(lines):
    """Neighbouring lines of one kind: (is code, lines)."""
    found = []
    for line in lines:
        is_code = bool(CODE.match(line))
        if not line.strip():
            found.append((False, []))
        elif found and found[-1][0] == is_code:
            found[-1][1].append(line)
        else:
            found.append((is_code, [line]))
    return [block for block in found if block[1]]


def code_block(lines):
    margin = min(len(line) - len(line.lstrip()) for line in lines)
    return "::\n\n" + "\n".join("   " + line[margin:] for line in lines)


def prose(lines):
    return "\n\n".join(code_block(part) if is_code else inline(one_line(" ".join(part)))
                       for is_code, part in blocks(lines))


def requirements(text):
    rules = [rule for rule in one_line(text).strip().rstrip(".").split("; ") if rule]
    return ":Requires:\n" + "\n".join(f"   - {inline(rule)}" for rule in rules)


def rst_of_comment(lines):
    """What stands before the first "Requires:" is prose, what follows each is a list of rules."""
    said, *required = REQUIRES.split("\n".join(lines))
    parts = [prose(said.split("\n")), *(requirements(part) for part in required)]
    return "\n\n".join(part for part in parts if part)
