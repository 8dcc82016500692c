"""Generates docs/api.md and lists what is missing from it."""
import re

from api.headers import read_names, read_requirements
from api.messages import read_rules
from api.tests import read_tests, tests_of_names, tests_of_rules

OPENING = [
    "# The public names and requirements", "",
    "The test of every public name and of every requirement that the headers state. Signatures and explanations are in "
    "the reference of the documentation site, which `tools/docs` builds.", "",
    "Written by `tools/api_table` from the headers' comments, the messages and the tests; `ctest -R api_table` "
    "fails when it is stale, when a name or requirement has no test, when a message breaks a rule that no header "
    "states, or a header states one that no message breaks.", ""]


def cell(text):
    return text.replace("|", "\\|").replace("<", "&lt;")


def shown(test):
    return test.name if test else "**none**"


def by_header(items):
    groups = {}
    for item in items:
        groups.setdefault(item.header, []).append(item)
    return groups.items()


class Page:
    def __init__(self, root):
        self.names, self.requirements, self.rules = read_names(root), read_requirements(root), read_rules(root)
        tests = read_tests(root)
        self.test_of_name = tests_of_names(root, self.names, tests)
        self.tests_of_rule = tests_of_rules(self.rules, tests)
        self.rules_of = {r: [rule for rule in self.rules if r.says(rule)] for r in self.requirements}

    def test_of(self, requirement):
        """Among the tests that break the rule, prefers one that names the rule's subject."""
        tests = [test for rule in self.rules_of[requirement] for test in self.tests_of_rule.get(rule, [])]
        word = re.compile(r"\b" + re.escape(requirement.of.split("::")[-1]) + r"\b")
        return next((test for test in tests if word.search(test.code)), tests[0] if tests else None)

    def breaker(self, requirement):
        return shown(self.test_of(requirement))

    def text(self):
        return "\n".join(OPENING + self.table_of_names() + self.table_of_requirements())

    def table_of_names(self):
        out = ["## Names", ""]
        for header, names in by_header(self.names):
            out += [f"### {header}", "", "| name | test |", "|---|---|"]
            out += [f"| `{n.full}` | {shown(self.test_of_name.get(n))} |" for n in names]
            out.append("")
        return out

    def table_of_requirements(self):
        out = ["## Requirements", "", "The requirements on callers, worded as in the error message for a violation, "
               "each with the test that violates it.", ""]
        for header, requirements in by_header(self.requirements):
            out += [f"### {header}", "", "| of | requires | raises | test |", "|---|---|---|---|"]
            out += [f"| `{r.of}` | {cell(r.text)} | {r.kind} | {self.breaker(r)} |" for r in requirements]
            out.append("")
        return out

    def missing(self):
        for name in self.names:
            if name not in self.test_of_name:
                yield f"{name.header}:{name.line}: no test: {name.kind} {name.full}"
        for r in self.requirements:
            if not self.rules_of[r]:
                yield f"{r.header}:{r.line}: no message says: {r.text} ({r.kind})"
            elif not self.test_of(r):
                yield f"{r.header}:{r.line}: no test: {r.text}"
        stated = {rule for rules in self.rules_of.values() for rule in rules}
        for rule in self.rules:
            if rule not in stated:
                yield f"{rule.file}:{rule.line}: no header states: {rule.text} ({rule.kind})"

    def counts(self):
        explained = sum(bool(name.comment) for name in self.names)
        return (f"{len(self.names)} names, {explained} of them explained, {len(self.requirements)} requirements, "
                f"{len({rule.text for rule in self.rules})} rules")
