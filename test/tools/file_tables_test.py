"""The check of tables of files: names without a file, and files that a README does not name."""
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

from words.file_tables import findings_in_tables  # noqa: E402

HEAD = "| files | purpose |\n|---|---|\n"


def findings(page, *files):
    """What is found in the README of a folder with these files."""
    with tempfile.TemporaryDirectory() as parent:
        folder = Path(parent) / "lens"
        tracked = [folder / name for name in (*files, "README.md")]
        for path in tracked:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(page if path == folder / "README.md" else "")
        return list(findings_in_tables(folder / "README.md", tracked))


def absent(name, line, folder="lens"):
    return line, f"there is no {name} in {folder}/"


def forgotten(name):
    return 1, f"does not name {name}: add it to a table of files"


class FileTables(unittest.TestCase):
    def test_a_row_names_files_with_or_without_suffix(self):
        page = HEAD + "| `loss`, `ray.h` | the loss; a ray |\n"
        self.assertEqual(findings(page, "loss.cpp", "loss.h", "ray.h"), [])
        self.assertEqual(findings(page, "ray.cpp"), [absent("loss", 3), absent("ray.h", 3), forgotten("ray")])

    def test_each_source_file_has_a_row(self):
        page = HEAD + "| `loss` | the loss |\n"
        self.assertEqual(findings(page, "loss.cpp", "ray.h", "ray.cpp", "data.json"), [forgotten("ray")])

    def test_the_text_may_name_a_file_instead(self):
        page = "Read `ray.h` first.\n\n" + HEAD + "| `loss` | the loss |\n"
        self.assertEqual(findings(page, "loss.cpp", "ray.h", "ray.cpp"), [])

    def test_a_pattern_names_the_files_that_match(self):
        page = HEAD + "| `api_*.cpp` | calls |\n"
        self.assertEqual(findings(page, "api_copy.cpp", "api_launch.cpp"), [])
        self.assertEqual(findings(page, "copy.cpp"), [absent("api_*.cpp", 3), forgotten("copy")])

    def test_a_folder_names_all_that_it_contains(self):
        page = HEAD + "| `rules/` | derivatives |\n"
        self.assertEqual(findings(page, "rules/sine.cpp", "rules/powers/power.cpp"), [])
        self.assertEqual(findings(page, "rules/sine.cpp", "time/step.cpp"), [forgotten("time/step")])

    def test_a_table_below_the_name_of_a_subfolder(self):
        page = HEAD + "| `loss` | the loss |\n\n`rules/`: derivatives\n\n" + HEAD + "| `sine` | its derivative |\n"
        self.assertEqual(findings(page, "loss.h", "rules/sine.cpp"), [])
        self.assertEqual(findings(page, "loss.h", "sine.h", "rules/cosine.cpp"),
                         [absent("sine", 9, "lens/rules"), forgotten("rules/cosine"), forgotten("sine")])
        self.assertEqual(findings(page + "\nShared parts\n\n" + HEAD + "| `ray` | a ray |\n", "loss.h", "ray.h",
                                  "rules/sine.cpp"), [])

    def test_a_subfolder_with_its_own_page_is_not_described_here(self):
        page = HEAD + "| `loss` | the loss |\n"
        self.assertEqual(findings(page, "loss.h", "gpu/README.md", "gpu/device.cpp"), [])

    def test_other_tables_are_free(self):
        self.assertEqual(findings("| method | steps |\n|---|---|\n| `adam` | 4000 |\n", "main.cpp"), [])


if __name__ == "__main__":
    unittest.main()
