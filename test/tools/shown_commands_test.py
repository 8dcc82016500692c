"""The check of shown commands: scripts, sub-commands and options that do not exist."""
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

from words.shown_commands import Programs, commands_in, findings_in_commands  # noqa: E402

FILES = {
    "apps/lens/main.cpp": 'app.add_option("--shorter", percent);',
    "apps/common/options.cpp": 'app.add_option("--steps", steps);',
    "tools/opt/main.cpp": 'value_of(arg, "pass")',
    "tools/bench": "case $what in kernels | model) ;; esac",
    "tools/packages.list": "[build]",
    "bench/model.py": 'parser.add_argument("--plot")',
    "CMakePresets.json": "{}",
}


def shell(*lines):
    return "Text.\n```sh\n" + "\n".join(lines) + "\n```\n"


class Commands(unittest.TestCase):
    def test_lines_of_shell_blocks(self):
        page = "```cpp\nlens --a\n```\n" + shell("lens --input A   # a lens", "     [--steps N]", "", "# none", "cd out")
        self.assertEqual(commands_in(page), [(6, ["lens", "--input", "A", "[--steps", "N]"]), (10, ["cd", "out"])])

    def test_quoted_words_with_an_option(self):
        self.assertEqual(commands_in("Run `opt --list` or `opt`."), [(1, ["opt", "--list"])])


class Findings(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for name, text in FILES.items():
            path = Path(folder.name) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        self.programs = Programs(Path(folder.name))

    def found(self, page):
        return [text for _, text in findings_in_commands(page, self.programs)]

    def test_what_exists(self):
        self.assertEqual(self.found(shell("lens --shorter 3", "lens [--steps N]",
                                          "./tools/bench kernels", "A=1 tools/bench model --plot FILE",
                                          "out/build/release/tools/opt --pass=simplify", "python3 bench/model.py --plot F",
                                          "cmake --no-such-option", "tools/bench NAME")), [])

    def test_an_option_that_is_gone(self):
        self.assertEqual(self.found(shell("lens --shorter 3 --short 3")), ["lens has no option --short"])
        self.assertEqual(self.found("`opt --passes=simplify`"), ["opt has no option --passes"])
        self.assertEqual(self.found(shell("python3 bench/model.py", "  [--plots FILE]")),
                         ["bench/model.py has no option --plots"])

    def test_a_sub_command_that_is_gone(self):
        self.assertEqual(self.found(shell("tools/bench kernel --plot F")), ["tools/bench has no \"kernel\""])

    def test_a_script_that_is_gone(self):
        self.assertEqual(self.found(shell("./tools/measure --quick")), ["there is no ./tools/measure"])


if __name__ == "__main__":
    unittest.main()
