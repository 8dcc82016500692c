#!/usr/bin/env python3
"""Tests the statistics of judge.py and how plans.py reads a worker."""
import argparse
import io
import json
import os
import stat
import sys
import tempfile
import unittest
from contextlib import redirect_stdout
from unittest import mock

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import judge  # noqa: E402
import plans  # noqa: E402


def plan(key, predicted, seconds, default=1.0, **more):
    price = {"seconds": predicted, "stages": {}, "peak_bytes": 8.0, "price_seconds": 0.02}
    return {"key": key, "source": "search", "seconds": seconds, "default_seconds": default, "runs": 5,
            "prices": {"predict": price}, **more}


def program(*rows, again=(1.0, 1.0)):
    return {"plans": list(rows), "again": {"seconds": again[0], "default_seconds": again[1]}}


class Statistics(unittest.TestCase):
    def always(self, i, j):
        return True

    def test_tau_is_1_for_the_same_order_and_minus_1_for_the_reverse(self):
        same = [(1, 10), (2, 20), (3, 30)]
        self.assertEqual(judge.kendall_tau_b(same, self.always), 1)
        self.assertEqual(judge.kendall_tau_b([(-p, m) for p, m in same], self.always), -1)

    def test_equal_predictions_are_ties(self):
        # Three pairs: two concordant, one tied. (2 - 0) / sqrt(3 * 2).
        self.assertAlmostEqual(judge.kendall_tau_b([(1, 1), (2, 2), (2, 3)], self.always), 2 / 6 ** 0.5)
        self.assertIsNone(judge.kendall_tau_b([(1, 1), (1, 2)], self.always))

    def test_pairs_within_the_noise_do_not_count(self):
        pairs = [(2, 1.00), (1, 1.01), (3, 9)]
        self.assertEqual(judge.kendall_tau_b(pairs, lambda i, j: abs(pairs[i][1] - pairs[j][1]) > 0.1), 1)

    def test_regret_compares_the_predicted_choice_with_the_fastest(self):
        self.assertEqual(judge.regret([(3, 6), (1, 5), (2, 4)]), 1.25)
        self.assertEqual(judge.regret([(1, 5), (1, 4)]), 1.25)  # the first of equal ones, as in a search

    def test_a_ratio_counts_in_both_directions(self):
        self.assertEqual(judge.share_within([1, 1.4, 1 / 1.4, 1.6, 1 / 1.6], 1.5), 0.6)


class Programs(unittest.TestCase):
    def test_a_time_is_relative_to_the_default_beside_it(self):
        measured = judge.measured_plans(program(plan("a", 1, 1.0), plan("b", 1, 2.1, 1.05)))
        self.assertEqual([p["time"] for p in measured], [1.0, 2.0])

    def test_disturbed_and_failed_plans_are_left_out(self):
        measured = judge.measured_plans(program(plan("a", 1, 2.2, 2.0), plan("b", 1, 4, 2), plan("c", 1, 3),
                                                {"key": "d", "error": "it ended"}))
        self.assertEqual([p["key"] for p in measured], ["a", "c"])

    def test_noise_is_the_difference_of_copies_of_the_default(self):
        self.assertEqual(judge.noise_of(program(plan("a", 1, 1.0))), judge.LEAST_NOISE)
        self.assertAlmostEqual(judge.noise_of(program(plan("a", 1, 1.0), again=(1.1, 1.0))), 0.1)

    def staged(self, predicted, measured, sampled=10.0, shared=None):
        first = plan("a", 1, 1.0, stages=measured, stages_seconds=1.0, sampled_seconds=sampled, shared=shared or {})
        first["prices"]["predict"]["stages"] = predicted
        return program(first)

    def test_stages_with_few_samples_do_not_count(self):
        found = judge.stage_pairs(self.staged({"f": 1, "g": 1}, {"f": 0.9, "g": 0.0001}), "predict")
        self.assertEqual([(p, m) for p, m, _ in found], [(1, 0.9)])

    def test_stages_that_share_loops_are_one(self):
        found = judge.stage_pairs(self.staged({"f": 1, "g": 2}, {"f": 0.9, "g": 0}, shared={"g": "f"}), "predict")
        self.assertEqual([(p, m) for p, m, _ in found], [(3, 0.9)])

    def test_stages_closer_than_their_samples_can_tell_do_not_differ(self):
        stages = {"f": 0.50, "g": 0.45, "h": 0.10}
        for sampled, tau in ((0.3, 1.0), (100.0, 1 / 3)):
            found = judge.stage_pairs(self.staged({"f": 1, "g": 2, "h": 0.1}, stages, sampled), "predict")
            self.assertAlmostEqual(judge.stages_tau(found), tau)

    def test_wrong_pairs_differ_clearly_and_are_ordered_wrongly(self):
        rows = [plan("a", 1.0, 1.0), plan("b", 0.9, 1.5), plan("c", 0.8, 1.2), plan("d", 2.0, 3.0)]
        found = judge.wrong_pairs(program(*rows), "predict")
        self.assertEqual([(fast["key"], slow["key"]) for fast, slow, _, _ in found], [("a", "b")])

    def test_the_table_has_every_program(self):
        failed = {"plans": [{"key": "x", "error": "it ended"}], "error": "no"}
        rows = [plan("a", 1, 1.0), plan("b", 4, 2.0), plan("c", 3, 3.0), plan("d", 5, 4.0)]
        report = {"runs": [{"commit": "abc", "programs": {"blur": program(*rows), "warp": failed}}]}
        text = judge.table(report)
        self.assertIn("| blur | 4 | 1e+03 | 1e+03 | 2 % | – | 0.80 | 1.00 | 1.00 |", text)
        self.assertIn("| warp | failed |", text)
        self.assertIn("| regret, worst | 1.00 |", text)

    def test_searches_over_moves_are_compared_with_the_default(self):
        rows = [plan("a", 1, 1.0, source="default, beam 1"), plan("b", 4, 2.0, source="beam 4"), plan("c", 4, 0.5)]
        run = {"programs": {"blur": program(*rows), "warp": program(plan("d", 1, 1.0, source="default, beam 4"))}}
        self.assertEqual(judge.times_of_sources(run, "beam "),
                         {"1": [("blur", 1.0)], "4": [("blur", 2.0), ("warp", 1.0)]})
        self.assertIn("width 4 takes, over that of the default plans: geometric mean 1.41", judge.searched_text(run))
        self.assertIn("at worst 2.00 (blur)", judge.searched_text(run))

    def test_ablation_compares_with_the_plan_that_all_moves_find(self):
        rows = [plan("a", 1, 2.0, source="default"), plan("b", 4, 1.0, source="beam 1, no root"),
                plan("c", 4, 1.5, source="no tile")]
        run = {"programs": {"blur": program(*rows)}}
        self.assertEqual(judge.ablation(run), {"root": [("blur", 1.0)], "tile": [("blur", 1.5)]})
        self.assertIn("| `tile` | 1 | 1.50 | 1.50 (blur) |", judge.ablation_text(run))
        self.assertIn("| `root` | 0 | 1.00 | – |", judge.ablation_text(run))

    def test_a_program_that_a_model_cannot_price_has_no_figures(self):
        rows = [plan("a", 1, 1.0), plan("b", 4, 2.0)]
        rows[0]["prices"], rows[1]["prices"] = {}, {}
        self.assertIsNone(judge.judge_program(program(*rows), "predict"))


WORKER = """#!/bin/sh
case "$*" in
  *--skip*bad*) echo '{"starts": "good"}'
                echo '{"key": "good", "seconds": 1.0, "default_seconds": 1.0, "prices": {}, "source": "walk"}'
                echo '{"again": {"seconds": 1.0, "default_seconds": 1.0}}' ;;
  *) echo '{"machine": "m"}'
     echo '{"starts": "first"}'
     echo '{"key": "first", "seconds": 1.0, "default_seconds": 1.0, "prices": {}, "source": "default"}'
     echo '{"starts": "bad"}'; echo 'out of memory' >&2; exit 3 ;;
esac
"""


class Driver(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        os.makedirs(self.path("bench"))
        with open(self.path("bench/bench_plans"), "w", encoding="utf-8") as file:
            file.write(WORKER)
        os.chmod(self.path("bench/bench_plans"), stat.S_IRWXU)
        with open(self.path("some.graph"), "w", encoding="utf-8") as file:
            file.write("output f")

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_plans(self, *more):
        words = ["plans.py", self.folder.name, "--graphs", self.folder.name, "--program", "*", "--output",
                 self.path("plans.json"), *more]
        with mock.patch.object(sys, "argv", words), redirect_stdout(io.StringIO()) as text:
            plans.main()
        with open(self.path("plans.json"), encoding="utf-8") as file:
            return json.load(file), text.getvalue()

    def test_a_plan_that_ends_the_process_is_skipped_by_the_next_one(self):
        report, _ = self.run_plans()
        rows = report["runs"][0]["programs"]["some"]["plans"]
        self.assertEqual([row["key"] for row in rows], ["first", "bad", "good"])
        self.assertEqual(rows[1]["error"], "out of memory")

    def test_a_program_that_is_in_the_report_is_not_measured_again(self):
        self.run_plans()
        with open(self.path("bench/bench_plans"), "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\nexit 1\n")
        report, text = self.run_plans()
        self.assertEqual(len(report["runs"]), 1)
        self.assertEqual(len(report["runs"][0]["programs"]["some"]["plans"]), 3)
        report, text = self.run_plans("--decisions", "5")  # other settings: a run of their own
        self.assertEqual(len(report["runs"]), 2)
        self.assertIn("failed", text)

    def test_programs_run_in_the_order_of_the_patterns(self):
        for name in ("a-x", "b-x", "b-y"):
            with open(self.path(name + ".graph"), "w", encoding="utf-8") as file:
                file.write("output f")
        options = argparse.Namespace(program=["b-*", "*x"], long=False)
        self.assertEqual(plans.chosen_programs(self.folder.name, options), ["b-x", "b-y", "a-x"])

    def test_of_two_measurements_the_less_disturbed_one_is_kept(self):
        rows = [plan("a", 1, 2.0, 2.0, stages={"f": 1})]
        plans.keep_row(rows, plan("a", 1, 1.0, 1.0))
        plans.keep_row(rows, plan("a", 1, 3.0, 3.0))
        self.assertEqual((rows[0]["seconds"], rows[0]["stages"], len(rows)), (1.0, {"f": 1}, 1))

    def test_a_plan_that_takes_too_long_fails(self):
        with open(self.path("bench/bench_plans"), "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\necho '{\"starts\": \"slow\"}'; exec sleep 60\n")
        report, _ = self.run_plans("--limit", "0.2")
        self.assertEqual(report["runs"][0]["programs"]["some"]["plans"][0]["error"], "took more than 0.2 s")


if __name__ == "__main__":
    unittest.main()
