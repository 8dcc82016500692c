"""Sections of documents that state measured figures: each names its commit, what it measures, and whether it is old.

A section reaches from a heading to the next one. The commit stands in its text ("at commit 5706bab") or in a column of
a table; if there are several, the oldest counts. What the section measures stands in a comment below the heading:

    <!-- measures: compiler/lower compiler/codegen runtime bench/kernels -->

The age of a section is the number of commits since its own that touched one of these paths.
"""
import re
import subprocess

# In so many commits to what it runs, a benchmark has moved by more than the noise of its figures: readers are told.
OLD = 150
# By then most of what was measured has been written anew, so that the figures support no claim.
TOO_OLD = 4 * OLD
MARK = "**Old figures:**"

HEADING = re.compile(r"#+ (.*)")
HASH = "[0-9a-f]{7,40}"
# In a column, a number is no commit.
COMMIT = re.compile(rf"\bcommit\s+({HASH})\b|\| (?=\d*[a-f])(?=[a-f]*\d)({HASH}) (?=\|)")
MEASURES = re.compile(r"<!-- measures:(.*?)-->", re.DOTALL)
UNIT = r"(?:ns|us|ms|s|MB|GB/s)"
# A table whose cells have units behind numbers, or whose header has one by itself: "| rules ms |", "| time [s] |".
FIGURES = re.compile(rf"^\|.*(?:\d {UNIT}\b|[ ,\[]{UNIT}\]? *\|.*\n\|[ :|-]+$)", re.MULTILINE)


class History:
    """The commits of a repository. `is_complete` is false for a shallow clone, an exported tree, and a repository that
    has none of the named commits."""

    def __init__(self, root, commits):
        self.root = root
        self.is_complete = (self._git("rev-parse", "--show-prefix") == ""
                            and self._git("rev-parse", "--is-shallow-repository") == "false"
                            and any(self._git("cat-file", "-e", commit) is not None for commit in commits))

    def age(self, commit, paths):
        """The number of commits since this one that touched these paths, or None if there is no such commit."""
        count = self._git("rev-list", "--count", f"{commit}..HEAD", "--", *paths)
        return int(count) if count else None

    def _git(self, *arguments):
        done = subprocess.run(["git", *arguments], cwd=self.root, capture_output=True, text=True)
        return done.stdout.strip() if done.returncode == 0 else None


class Section:
    def __init__(self, line, title, text):
        self.line, self.title, self.text = line, title, text
        self.commits = [first or second for first, second in COMMIT.findall(text)]
        measures = MEASURES.search(text)
        self.paths = measures.group(1).split() if measures else []


def sections_of(page):
    """The sections of a page, without its code."""
    line, title, lines, in_code = 1, "", [], False
    for number, text in enumerate(page.splitlines(), 1):
        in_code ^= text.lstrip().startswith("```")
        heading = None if in_code else HEADING.match(text)
        if heading:
            yield Section(line, title, "\n".join(lines))
            line, title, lines = number, heading.group(1), []
        elif not in_code:
            lines.append(text)
    yield Section(line, title, "\n".join(lines))


def commits_in(pages):
    return [commit for page in pages for section in sections_of(page) for commit in section.commits]


def findings_in_page(page, root, history):
    """(line number, finding) for each section that states figures without a basis, or that is too old."""
    for section in sections_of(page):
        for finding in findings_in_section(section, root, history):
            yield section.line, f"\"{section.title}\" {finding}"


def findings_in_section(section, root, history):
    if not section.commits:
        if section.paths or FIGURES.search(section.text):
            yield "states figures but no commit: add \"at commit\" and the commit that was measured"
        return
    if not section.paths:
        yield "has no list of what it measures: add <!-- measures: PATHS --> below the heading"
    absent = [path for path in section.paths if not (root / path).exists()]
    if absent:
        yield f"measures {', '.join(absent)}, which is not there"
    elif section.paths and history.is_complete:
        yield from findings_of_age(section, history)


def findings_of_age(section, history):
    ages = {commit: history.age(commit, section.paths) for commit in section.commits}
    unknown = [commit for commit, age in ages.items() if age is None]
    if unknown:
        yield f"names {', '.join(unknown)}, which is no commit"
        return
    oldest = max(ages, key=ages.get)
    age = f"has figures of {oldest}; {ages[oldest]} commits have changed what it measures since"
    if ages[oldest] > TOO_OLD:
        yield f"{age} (at most {TOO_OLD}): measure it again or remove it"
    elif ages[oldest] > OLD and MARK not in section.text:
        yield f"{age}: measure it again, or add \"> {MARK} taken more than {OLD} commits ago.\""
