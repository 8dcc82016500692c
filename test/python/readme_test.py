"""The programs of the READMEs run as they stand."""
import os
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def programs(path):
    return re.findall(r"```python\n(.*?)```", (ROOT / path).read_text(), re.S)


class Readmes(unittest.TestCase):
    def run_all(self, path, at_least):
        found = programs(path)
        self.assertGreaterEqual(len(found), at_least)
        for program in found:
            exec(compile(program, path, "exec"), {})
        return found

    def test_the_project_s(self):
        program = self.run_all("README.md", 1)[0]
        lines = [line for line in program.splitlines() if line.strip()]
        self.assertLessEqual(len(lines), 10)

    @unittest.skipIf("RETROGRADE_SANITIZER" in os.environ, "the runtime that is linked needs the sanitizer")
    def test_the_package_s(self):
        self.run_all("python_bindings/README.md", 2)


if __name__ == "__main__":
    unittest.main()
