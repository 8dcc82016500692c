"""The check of measured sections: what it takes for figures, and when it finds them too old."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

from words.measured_sections import MARK, OLD, TOO_OLD, History, findings_in_page  # noqa: E402

MEASURES = "<!-- measures: tools\n test -->\n"
AT = "Measured at commit 0123abc.\n"


class Ages:
    """A history in which each commit has the given age."""
    is_complete = True

    def __init__(self, **ages):
        self.ages = ages

    def age(self, commit, paths):
        assert paths == ["tools", "test"]
        return self.ages.get("at_" + commit)


def findings(section, **ages):
    page = "# Page\n\n## Blur\n" + section
    return [text for line, text in findings_in_page(page, ROOT, Ages(**ages)) if line == 3]


class Form(unittest.TestCase):
    def assert_one(self, found, words):
        self.assertEqual(len(found), 1, found)
        self.assertIn(words, found[0])

    def test_a_commit_needs_what_was_measured(self):
        self.assert_one(findings(AT), "no list of what it measures")
        self.assert_one(findings("| what | commit |\n|---|---|\n| blur | 0123abc |\n"), "no list of what it measures")

    def test_figures_need_a_commit(self):
        for table in ("| what | time |\n|---|---|\n| blur | 3.5 ms |\n", "| what | ms |\n|---|---|\n| blur | 3.5 |\n",
                      "| what, ms | ours |\n|---|---|\n| blur | 3.5 |\n", MEASURES):
            self.assert_one(findings(table), "no commit")

    def test_tables_without_units_are_no_figures(self):
        self.assertEqual(findings("| what | size |\n|---|---|\n| blur | 1048576 |\n| `f.tile` | 8 rows |\n"), [])
        self.assertEqual(findings("```\n| what | time |\n| blur | 3.5 ms |\n```\n"), [])

    def test_paths_exist(self):
        self.assert_one(findings("<!-- measures: tools nowhere -->\n" + AT), "nowhere, which is not there")

    def test_a_section_ends_at_the_next_heading(self):
        self.assertEqual(findings("Text.\n\n### Below\n" + AT), [])


class Age(unittest.TestCase):
    def test_recent_figures_pass(self):
        self.assertEqual(findings(MEASURES + AT, at_0123abc=OLD), [])

    def test_old_figures_say_so(self):
        self.assertIn("0123abc; 151 commits", findings(MEASURES + AT, at_0123abc=151)[0])
        self.assertEqual(findings(MEASURES + f"> {MARK} older.\n\n" + AT, at_0123abc=TOO_OLD), [])

    def test_very_old_figures_go(self):
        marked = MEASURES + f"> {MARK} older.\n\n" + AT
        self.assertIn("measure it again or remove it", findings(marked, at_0123abc=TOO_OLD + 1)[0])

    def test_the_oldest_commit_counts(self):
        both = MEASURES + AT + "The last row is from commit\n4567def.\n"
        self.assertIn("4567def; 200 commits", findings(both, at_0123abc=3, at_4567def=200)[0])

    def test_a_commit_exists(self):
        self.assertIn("0123abc, which is no commit", findings(MEASURES + AT)[0])


class Histories(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def git(self, *arguments):
        settings = ["-c", "user.name=A", "-c", "user.email=a@example.com", "-c", "protocol.file.allow=always"]
        done = subprocess.run(["git", *settings, *arguments], cwd=self.folder, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    def commit(self, name):
        (self.folder / name).write_text("text\n" + name)
        self.git("add", ".")
        self.git("commit", "-q", "-m", name)
        return self.git("rev-parse", "HEAD")

    def test_counts_commits_that_touch_the_paths(self):
        self.git("init", "-q")
        first = self.commit("a")
        for name in ("b", "c", "d"):
            self.commit(name)
        history = History(self.folder, [first])
        self.assertTrue(history.is_complete)
        self.assertEqual([history.age(first, ["b", "d"]), history.age(first, ["a"])], [2, 0])
        self.assertIsNone(history.age("0123abc", ["a"]))

    def test_other_trees_have_no_history(self):
        self.assertFalse(History(self.folder, ["0123abc"]).is_complete)
        self.git("init", "-q")
        first = self.commit("a")
        self.commit("b")
        self.assertFalse(History(self.folder, ["0123abc"]).is_complete)
        (self.folder / "exported").mkdir()
        self.assertFalse(History(self.folder / "exported", [first]).is_complete)
        self.git("clone", "-q", "--depth=1", f"file://{self.folder}", "shallow")
        self.assertFalse(History(self.folder / "shallow", [first]).is_complete)


if __name__ == "__main__":
    unittest.main()
