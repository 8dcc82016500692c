"""The commands of the documents that take seconds and need neither a network nor other packages.

    commands_test.py BUILD

Elsewhere: test/unit/lower/pass_observer_test.cpp runs `opt`, test/gpu_check `gpu_check`, test/install the program of
the README, test/apps the applications.
"""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


class Commands(unittest.TestCase):
    build = None  # of the command line

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_program(self, program, *arguments):
        """What the program prints; it must succeed."""
        command = [self.build / program, *map(str, arguments)]
        environment = {**os.environ, "XDG_CACHE_HOME": str(self.folder)}
        environment.pop("RETROGRADE_MACHINE", None)
        done = subprocess.run(command, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              env=environment)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    # docs/autoscheduler.md, tools/README.md

    def test_tune_shows_the_figures(self):
        self.assertRegex(self.run_program("tools/tune", "--show"), r"constants: \d+ threads")

    def test_tune_measures_the_machine(self):
        self.run_program("tools/tune", "--machine", "--output", "machine.json")
        self.assertIn("threads", json.loads((self.folder / "machine.json").read_text()))
        self.run_program("tools/tune", "--machine")
        self.assertNotIn("constants", self.run_program("tools/tune", "--show"))

    def test_tune_measures_schedules_of_a_program(self):
        program = self.build / "test/tutorials/tutorial_gradients_learn_a_blur"
        text = self.run_program("tools/tune", "--seconds", 1, "--output", "tuned", "--", program)
        self.assertIn("best:", text)
        written = {path.suffix for path in (self.folder / "tuned").iterdir()}
        self.assertLessEqual({".schedule", ".cpp"}, written)
        self.assertIn("written to", self.run_program("tools/tune", "--fit", "--output", "fitted.json"))

    # test/gradient/adversary/README.md

    def test_fuzz_repeats_one_program(self):
        self.assertIn("1 programs, 0 findings", self.run_program("test/fuzz_adjoints", "--seed", 1234))
        printed = self.run_program("test/fuzz_adjoints", "--seed", 1234, "--print")
        self.assertRegex(printed, r"(?m)^func ")

    def test_fuzz_draws_programs_in_the_forms_of_users(self):
        text = self.run_program("test/fuzz_adjoints", "--style", "workloads", "--from", 1, "--count", 4)
        self.assertIn("4 programs, 0 findings", text)

    def test_fuzz_looks_for_a_refusal(self):
        self.run_program("test/fuzz_adjoints", "--from", 1, "--count", 3, "--want", "must be bounded")

    def test_fuzz_checks_schedules(self):
        text = self.run_program("test/fuzz_schedules", "--seed", 1234, "--memory", 200)
        self.assertIn("1 programs, 0 findings", text)

    # CONTRIBUTING.md

    def test_presets_exist(self):
        presets = json.loads((ROOT / "CMakePresets.json").read_text())
        kinds = {"cmake --preset": "configurePresets", "cmake --build --preset": "buildPresets",
                 "ctest --preset": "testPresets"}
        page = (ROOT / "CONTRIBUTING.md").read_text()
        for command, kind in kinds.items():
            shown = re.findall(rf"^{command} (\w+)", page, re.MULTILINE)
            self.assertTrue(shown, command)
            self.assertLessEqual(set(shown), {preset["name"] for preset in presets[kind]})


if __name__ == "__main__":
    Commands.build = Path(sys.argv.pop(1)).resolve()
    unittest.main()
