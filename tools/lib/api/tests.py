"""Test cases: which names they use, and which rules they break."""
import re

from api.cpp_text import closing, one_line, pieces, without_comments

CASE = re.compile(r"^(?:TEST|TEST_F|TEST_P|TYPED_TEST)\(\s*(\w+)\s*,\s*(\w+)\s*\)|^PIPELINE\((\w+)\)", re.M)
TAG = re.compile(r"// api: ([^\n]*)")
RULE_TAG = re.compile(r"// rule: ([^\n]*)")
SHORTEST_PHRASE = 9


class Test:
    def __init__(self, name, path, text):
        self.name, self.path = name, path
        self.tags = [tag.strip() for line in TAG.findall(text) for tag in line.split(",")]
        self.rule_tags = [tag.strip() for tag in RULE_TAG.findall(text)]
        self.code = without_comments(text)
        self.phrases = {one_line(p) for p in pieces(self.code) if len(p) >= SHORTEST_PHRASE}


def case_name(match, path):
    if match.group(3):
        return "differential_test.differential." + match.group(3)
    return f"{path.stem}.{match.group(1)}.{match.group(2)}"


def cases_of(root, path):
    """Splits a file into cases. The text between two cases belongs to the second."""
    text = path.read_text()
    starts = list(CASE.finditer(text))
    begin = 0
    for i, match in enumerate(starts):
        end = closing(text, text.find("{", match.end())) + 1 if "{" in text[match.end():] else len(text)
        last = i + 1 == len(starts)
        yield Test(case_name(match, path), path, text[begin:] if last else text[begin:end])
        begin = end
    if not starts and path.suffix == ".cpp":
        yield Test(str(path.relative_to(root)), path, text)


def read_tests(root):
    return [test for path in sorted((root / "test").rglob("*"))
            if path.suffix in (".cpp", ".h") and path.is_file() for test in cases_of(root, path)]


# ---- rules ----

def stands_for(phrase, rule):
    """Whether expecting `phrase` means this rule, even if other rules contain it: it is at least half of the rule."""
    return any(phrase in part for part in rule.parts) and 2 * len(phrase) >= sum(map(len, rule.parts))


def tests_of_rules(rules, tests):
    """For each rule the tests that say it, or words of it alone, in a tag; else those that expect words of it
    which are in no other rule or are half of this one, most words first."""
    texts = {rule.text for rule in rules}
    tests_of = {}
    for test in tests:
        for phrase in test.phrases:
            tests_of.setdefault(phrase, []).append(test)
    said_by = {phrase: sum(phrase in text for text in texts) for phrase in tests_of}
    tags = [(tag, test) for test in tests for tag in test.rule_tags]
    result = {}
    for rule in rules:
        found = [test for tag, test in tags if tag == rule.text or (tag not in texts and tag in rule.text)]
        phrases = [phrase for phrase, count in said_by.items() if count and phrase in rule.text
                   and (count == 1 or stands_for(phrase, rule))]
        for phrase in sorted(phrases, key=lambda phrase: (-len(phrase), phrase)):
            # Programs that expect errors come first.
            found += sorted(tests_of[phrase], key=lambda test: (test.path.parent.name != "error", test.name))
        if found:
            result[rule] = found
    return result


# ---- names ----

FOLDERS = ["unit", "error", "gradient", "stability", "golden", "property", "differential"]


def folder_order(root, test):
    folder = test.path.relative_to(root / "test").parts[0]
    return FOLDERS.index(folder) if folder in FOLDERS else len(FOLDERS)


def tests_by_word(tests):
    by_word = {}
    for test in tests:
        for word in set(re.findall(r"\w+", test.code)):
            by_word.setdefault(word, []).append(test)
    return by_word


def tests_of_names(root, names, tests):
    """For each name the test that says it in a tag, else the shortest that uses it, of the folder first named.
    A member is used where its class is shown: by the test, or else by its file."""
    tagged = {tag: test for test in tests for tag in test.tags}
    tests = sorted(tests, key=lambda test: (folder_order(root, test), len(test.code)))
    by_word = tests_by_word(tests)
    file_texts = {test.path: test.path.read_text() for test in tests}
    shown_in, result = {}, {}

    def file_shows(owner, path):
        key = (owner.pattern, path)
        if key not in shown_in:
            shown_in[key] = bool(owner.search(file_texts[path]))
        return shown_in[key]

    for name in names:
        if name.full in tagged:
            result[name] = tagged[name.full]
            continue
        use, owner, second_best = name.use(), name.owner(), None
        for test in by_word.get(name.word, []) if name.word else tests:
            if not use.search(test.code):
                continue
            if not owner or owner.search(test.code):
                result[name] = test
                break
            if not second_best and file_shows(owner, test.path):
                second_best = test
        if name not in result and second_best:
            result[name] = second_best
    return result
