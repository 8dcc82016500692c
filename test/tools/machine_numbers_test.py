"""The check of machine numbers: which lines define one, and that the list of allowed lines may only shrink."""
import sys
import tempfile
import unittest
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True

loader = SourceFileLoader("check_machine_numbers", str(ROOT / "tools/check_machine_numbers"))
check = module_from_spec(spec_from_loader(loader.name, loader))
loader.exec_module(check)


class Lines(unittest.TestCase):
    def test_constants_named_after_parts_of_a_machine_count(self):
        for line in ("constexpr int lanes = 16;", "  static constexpr double least = 2, load_latency = 6.5;",
                     "inline constexpr int64_t block_bytes = 48'000;", "constexpr int64_t few_threads = 8;"):
            self.assertTrue(check.is_machine_number(line), line)

    def test_sizes_count(self):
        for line in ("f(16 << 20);", "constexpr int64_t much = int64_t{1} << 23;", "if (bytes > 384 << 10) {",
                     "const double most = 16384;"):
            self.assertTrue(check.is_machine_number(line), line)

    def test_other_lines_do_not_count(self):
        for line in ("constexpr int lanes = planning::schedule_lanes;", "constexpr int half = 512;", "int lanes = 16;",
                     "constexpr int64_t block_bytes = planning::second_cache_bytes / 2;", "// block_bytes = 1 << 20;",
                     'text("1 << 20");', "bits << 3;", "constexpr int most = 1000;", "constexpr double pi = 3.1415926;",
                     "constexpr int planes = 4;"):
            self.assertFalse(check.is_machine_number(line), line)


class Findings(unittest.TestCase):
    def found(self, allowed):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name in ("compiler/transform/rule.cpp", "autoschedule/machine/machine.h"):
                (root / name).parent.mkdir(parents=True)
                (root / name).write_text("int a;\nconstexpr int  lanes = 16;  // of a vector\n")
            return list(check.findings(root, allowed))

    def test_numbers_outside_of_the_description_of_machines_are_found(self):
        found = self.found({})
        self.assertEqual(len(found), 1)
        self.assertIn("compiler/transform/rule.cpp:2: `constexpr int lanes = 16;`", found[0])

    def test_lines_on_the_list_are_allowed(self):
        self.assertEqual(self.found({"compiler/transform/rule.cpp: constexpr int lanes = 16;": "a reason"}), [])

    def test_a_line_on_the_list_that_is_gone_is_found(self):
        found = self.found({"compiler/transform/rule.cpp: constexpr int lanes = 16;": "a reason",
                            "compiler/transform/rule.cpp: constexpr int lanes = 8;": "a reason"})
        self.assertEqual(len(found), 1)
        self.assertIn("constexpr int lanes = 8;", found[0])


if __name__ == "__main__":
    unittest.main()
