#!/usr/bin/env python3
"""Tests measurements.py: a section is replaced, the text around it stays, and missing sections are errors."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

here = os.path.dirname(os.path.abspath(__file__))
sys.path += [os.path.join(here, "operators")]
import decisions  # noqa: E402

PAGE = ("# Page\n\nBy hand.\n\n<!-- measured: programs -->\nold figures\n<!-- end of section -->\n\n"
        "<!-- measured: gradients -->\nkept\n<!-- end of section -->\nLast.\n")
PROGRAMS = {"programs": [
    {"program": "fast", "run_ratio": 0.5, "compile_ratio": 0.25,
     "cases": [{"retrograde_ms": 1.0, "halide_ms": 2.0}]},
    {"program": "slow", "run_ratio": 2.0, "compile_ratio": 1.0,
     "cases": [{"retrograde_ms": 4.0, "halide_ms": 2.0}]},
    {"program": "broken", "cases": [], "failure": "no worker"}]}
PAIR = {"kernel": "blur", "threads": 2, "retrograde_ms": 1.5, "halide_ms": 3.0, "run_ratio": 0.5,
        "compile_ratio": 0.2, "retrograde_peak_mb": 80.4, "halide_peak_mb": 90.6,
        "percent_of_bound": 41.7}

OPERATORS = {
    "machine": {"threads": 2, "bytes_per_second": 4e10, "flops": 1e11}, "versions": {"halide": "21.0.0"},
    "operators": [
        {"operator": "conv", "retrograde_ms": 8.0, "halide_best_ms": 2.0, "halide_best": "root",
         "pytorch_ms": 4.0, "pytorch_compiled_ms": None, "bound_ms": 1.0, "peak_mb": 90.0,
         "halide_best_peak_mb": 50.0, "pytorch_peak_mb": None, "compile_s": 0.5, "search_s": 0.25,
         "max_relative_error": 2e-6},
        {"operator": "warp", "retrograde_ms": None}]}


class Measurements(unittest.TestCase):
    def record(self, section, report, page=PAGE):
        with tempfile.TemporaryDirectory() as folder:
            names = [os.path.join(folder, name) for name in ("report.json", "page.md")]
            for name, text in zip(names, (json.dumps(report), page)):
                with open(name, "w", encoding="utf-8") as file:
                    file.write(text)
            self.done = subprocess.run(
                [sys.executable, os.path.join(here, "measurements.py"), section, *names,
                 "--commit", "abc1234", "--machine", "2 cores"],
                capture_output=True, text=True, check=False)
            with open(names[1], encoding="utf-8") as file:
                return file.read()

    def test_a_section_is_replaced_and_the_rest_stays(self):
        page = self.record("programs", PROGRAMS)
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        self.assertTrue(page.startswith("# Page\n\nBy hand.\n"))
        self.assertTrue(page.endswith("<!-- measured: gradients -->\nkept\n<!-- end of section -->\nLast.\n"))
        self.assertNotIn("old figures", page)
        self.assertIn("Measured on 2 cores, at commit abc1234.", page)
        self.assertIn("| fast | 0.50 | 1 / 2 | 0.25 |", page)

    def test_means_are_geometric_and_leave_out_what_failed(self):
        page = self.record("programs", PROGRAMS)
        self.assertIn("| broken | failed |", page)
        self.assertIn("Geometric means of 2: run time 1.00 of Halide 14's, compile time 0.50.", page)

    def test_recording_twice_changes_nothing(self):
        once = self.record("programs", PROGRAMS)
        self.assertEqual(self.record("programs", PROGRAMS, once), once)

    def test_pairs_have_their_memory_and_bound(self):
        page = self.record("kernels", [PAIR], PAGE.replace("programs", "kernels"))
        self.assertIn("| blur (2) | 1.50 ms | 3.00 ms | 0.50 | 0.20 | 80 / 91 | 42 % |", page)

    def test_operators_count_beside_the_best_other_and_say_what_is_missing(self):
        page = self.record("operators", OPERATORS, PAGE.replace("programs", "operators"))
        self.assertIn("| conv | 8 | 2 | 4 | – | root | 1 | 90 / 50 / – | 0.75 s | 2e-06 |", page)
        self.assertIn("| warp | failed |", page)
        self.assertIn("best other: 4.00.", page)

    def test_operators_of_pytorch_say_what_a_peer_could_not(self):
        row = {"operator": "curve", "failures": {"compiled": "no"}, "retrograde_error": 1e-7, "eager_error": 2e-7,
               "forward_ratio": 4.0, "both_ratio": 3.0, "retrograde_forward_ms": 1.0, "retrograde_both_ms": 2.0,
               "eager_forward_ms": 4.0, "eager_both_ms": 6.0}
        report = {"pytorch": "2.13", "operators": [row], "forward_geometric_mean": 4.0, "both_geometric_mean": 3.0,
                  "overhead_us": {"PyTorch": {"forward": 2.0}, "ours": {"forward": 5.5}}}
        page = self.record("torch", report, PAGE.replace("programs", "torch"))
        self.assertIn("| curve | 1 / 4 / – | 4.00 | 2 / 6 / – | 3.00 | 1e-07 / 2e-07 / – |", page)
        self.assertIn("forward 4.00, with backward 3.00 times as fast", page)
        self.assertIn("| PyTorch | 2.0 |\n| ours | 5.5 (+3.5) |", page)

    def test_programs_from_outside_say_which_are_held_out_and_which_failed(self):
        rows = [{"program": "jacobi", "failure": None, "failures": {}, "forward_ratio": 3.0, "both_ratio": 0.5,
                 "retrograde_forward_ms": 1.0, "retrograde_both_ms": 8.0, "eager_forward_ms": 3.0, "eager_both_ms": 4.0,
                 "retrograde_error": 2e-7, "retrograde_first_s": 1.25},
                {"program": "splat", "failure": "its process ended with -11", "failures": {}}]
        report = {"pytorch": "2.13", "held_out": ["splat"], "programs": rows, "means": {
            "held_out": {"programs": 1, "failures": 1},
            "others": {"programs": 1, "failures": 0, "forward": 3.0, "forward_below_1": 0, "forward_below_0.7": 0,
                       "both": 0.5, "both_below_1": 1, "both_below_0.7": 1}}}
        page = self.record("outside", report, PAGE.replace("programs", "outside"))
        self.assertIn("| jacobi | 1 / 3 / – | 3.00 | 8 / 4 / – | 0.50 | 2e-07 | 1.2 s |  |", page)
        self.assertIn("| splat * | – / – / – | – | – / – / – | – | – | – | failed |", page)
        self.assertIn("| held out | 1 | 1 | – | – |", page)
        self.assertIn("| others | 1 | 0 | 3.00 (0 below 1, 0 below 0.7) | 0.50 (1 below 1, 1 below 0.7) |", page)

    def test_a_model_says_how_it_orders_all_stages(self):
        row = {"program": "blur", "kind": "kernels", "predicted_ms": 3.0, "measured_ms": 4.0,
               "pairs": [[1.0, 1.5], [2.0, 2.5]], "rank_correlation": 1.0}
        other = {**row, "program": "warp", "kind": "operators", "pairs": [[0.5, 9.0]], "rank_correlation": None}
        page = self.record("model", {"programs": [row, other]}, PAGE.replace("programs", "model"))
        self.assertIn("| blur (kernel) | 2 | 1.00 | 3.00 | 4.00 |\n| warp (operator) | 1 | - | 3.00 | 4.00 |\n"
                      "| all | 3 | -0.50 |", page)

    def test_plans_are_judged_by_the_last_run(self):
        def row(key, predicted, seconds):
            return {"key": key, "source": "search", "seconds": seconds, "default_seconds": 1.0, "prices": {"predict": {
                "seconds": predicted, "stages": {}, "peak_bytes": 8.0, "price_seconds": 0.02}}}

        runs = [{"commit": commit, "programs": {"blur": {"plans": [row("a", 1.0, 1.0), row("b", predicted, 2.0)]}}}
                for commit, predicted in (("old", 0.5), ("new", 2.0))]
        page = self.record("plans", {"runs": runs}, PAGE.replace("programs", "plans"))
        self.assertIn("| regret, worst | 1.00 |", page)
        self.assertIn("| blur | 2 | 1e+03 | 1e+03 | 2 % | – | – | 1.00 | 1.00 |", page)

    def test_decisions_are_medians_beside_all_of_them(self):
        report = {"warp": {"": [1.0, 2.0, 9.0], "slices": [4.0], "all": None}}
        report["warp"].update({key: [2.0] for key in decisions.DECISIONS if key != "slices"})
        page = self.record("decisions", report, PAGE.replace("programs", "decisions"))
        self.assertIn("| with every decision | 2.0 |", page)
        self.assertIn("| without `slices` | 4.0 (×2.00) |", page)
        self.assertIn("| without all of them | failed |", page)

    def test_a_section_that_the_page_lacks_is_an_error_that_changes_nothing(self):
        self.assertEqual(self.record("kernels", [PAIR]), PAGE)
        self.assertNotEqual(self.done.returncode, 0)
        self.assertIn('"kernels"', self.done.stderr)


if __name__ == "__main__":
    unittest.main()
