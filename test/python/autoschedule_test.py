"""Schedules that nobody writes, schedules as values, and what they cost."""
import re
import unittest
from pathlib import Path

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")
HOST = rg.get_host_target()


def blur():
    image = rg.ImageParam("float32", 2, "image")
    horizontal, vertical = rg.Func("horizontal"), rg.Func("vertical")
    horizontal[x, y] = image[x, y] + image[x + 1, y]
    vertical[x, y] = horizontal[x, y] + horizontal[x, y + 1]
    vertical.set_estimates([(0, 256), (0, 256)])
    image.set_estimates([(0, 257), (0, 257)])
    image.set(np.arange(257 * 257, dtype=np.float32).reshape(257, 257) % 17)
    return image, horizontal, vertical


class Autoschedules(unittest.TestCase):
    def check_result(self, image, vertical):
        a = np.asarray(image.get())
        want = a[:-1, :-1] + a[:-1, 1:] + a[1:, :-1] + a[1:, 1:]
        np.testing.assert_array_equal(vertical.realize([256, 256]), want)

    def test_a_copy_gets_a_schedule_where_its_user_gave_none(self):
        x, y = rg.Var("x"), rg.Var("y")
        image, plain = rg.ImageParam("float32", 2, "image"), rg.Func("plain")
        plain[x, y] = image[x, y] * 2
        scheduled = rg.Pipeline(plain)._scheduled_copy(HOST)
        self.assertEqual(len(rg.Pipeline(plain).schedule_log()), 0)
        self.assertIn("Parallel", str(scheduled.schedule_log()))
        plain.vectorize(x, 4)
        kept = rg.Pipeline(plain)._scheduled_copy(HOST)
        self.assertEqual(str(kept.schedule_log()), str(rg.Pipeline(plain).schedule_log()))

    def test_a_copy_computes_costly_factors_of_sums_once(self):
        signal, counts, r = rg.ImageParam("float32", 1, "signal"), rg.Func("counts"), rg.RDom([(0, 256)])
        counts[x, y] = 0.0
        counts[x, y] += rg.exp(-abs(signal[r] - x)) * rg.exp(-abs(signal[r] - y))
        for d in range(2):
            counts.output_buffer().dim(d).set_bounds(0, 16)
        schedule = str(rg.Pipeline(counts)._scheduled_copy(HOST).schedule_log())
        self.assertIn("counts_factor", schedule)
        signal.set((np.arange(256) % 19).astype(np.float32))
        values = np.exp(-np.abs(np.asarray(signal.get())[:, None] - np.arange(16)))
        scheduled = rg.Pipeline(counts)._scheduled_copy(HOST).realize([16, 16])
        np.testing.assert_allclose(scheduled, values.T @ values, rtol=1e-5)
        self.assertEqual(len(rg.Pipeline(counts).schedule_log()), 0)

    def test_by_rules(self):
        image, horizontal, vertical = blur()
        results = rg.Pipeline(vertical).auto_schedule(HOST)
        self.assertEqual(results.scheduler_name, rg.built_in_autoscheduler)
        self.assertIn("vectorize", results.schedule_source)
        self.assertGreater(results.memory_bytes, 0)
        self.check_result(image, vertical)

    def test_options(self):
        image, horizontal, vertical = blur()
        options = rg.AutoscheduleOptions(without=[rg.Decision.strips], store=[horizontal], threads=2)
        rg.Pipeline(vertical).auto_schedule(HOST, options)
        self.assertIn("horizontal.compute_at(LoopLevel::root())", rg.Pipeline(vertical).schedule_log().to_cpp())
        self.check_result(image, vertical)
        again = rg.AutoscheduleOptions.from_string(options.to_string())
        self.assertEqual(again, options)
        self.assertEqual((again.store, again.threads, again.without), ([horizontal.name()], 2, {rg.Decision.strips}))
        self.assertEqual(len(rg.all_decisions()), 9)
        vertical.set_autoschedule(options)
        with self.assertRaisesRegex(rg.CompileError, "options of the autoscheduler"):
            rg.AutoscheduleOptions.from_string("slow=true")

    def test_of_a_user_s_own(self):
        image, horizontal, vertical = blur()

        def scheduler(pipeline, target, machine, results):
            for f in pipeline.outputs():
                f.vectorize(f.args()[0], 4)
            results.schedule_source = f"for {machine.parallelism} threads"

        rg.add_autoscheduler("Mine", scheduler)
        self.assertIn("Mine", rg.autoscheduler_names())
        results = rg.Pipeline(vertical).auto_schedule("Mine", HOST, rg.MachineParams(3, 1 << 20, 40))
        self.assertEqual(results.schedule_source, "for 3 threads")
        self.assertIn("vectorized", vertical.loop_nest())
        self.check_result(image, vertical)
        rg.add_autoscheduler("Mine", None)
        self.assertNotIn("Mine", rg.autoscheduler_names())
        with self.assertRaisesRegex(rg.CompileError, "loaded from a plugin before it is used"):
            rg.Pipeline(vertical).auto_schedule("Mine", HOST)
        with self.assertRaisesRegex(rg.CompileError, "shared library that can be opened"):
            rg.load_plugin("/no/such/plugin.so")
        rg.set_default_autoscheduler_name("")
        self.assertEqual(rg.default_autoscheduler_name(), rg.built_in_autoscheduler)
        self.assertEqual(rg.MachineParams("3,1048576,40"), rg.MachineParams(3, 1 << 20, 40))


class Driver(unittest.TestCase):
    def test_an_unscheduled_gradient_has_the_schedule_that_other_callers_get(self):
        """driver_test.cpp builds the same gradient."""
        image, taps = rg.ImageParam("float32", 2, "image"), rg.ImageParam("float32", 2, "taps")
        filtered, loss = rg.Func("filtered"), rg.Func("loss")
        near, everywhere = rg.RDom([(0, 3), (0, 3)], "near"), rg.RDom([(0, 640), (0, 480)], "all")
        filtered[x, y] += image[x + near.x, y + near.y] * taps[near.x, near.y]
        loss[()] += filtered[everywhere.x, everywhere.y] * filtered[everywhere.x, everywhere.y]
        gradient = rg.propagate_adjoints(loss)(taps)
        image.set_estimates([(0, 642), (0, 482)])
        gradient.set_estimates([(0, 3), (0, 3)])
        report = gradient.explain_schedule(rg.Target("x86-64-linux-avx-avx2-f16c-fma-sse41"))
        golden = Path(__file__).resolve().parent.parent / "golden/driver/unscheduled_gradient.schedule"
        self.assertEqual(re.sub("([A-Za-z])([$_][0-9]+)+", r"\1", report.schedule), golden.read_text())


class Logs(unittest.TestCase):
    def test_a_schedule_is_a_value(self):
        image, horizontal, vertical = blur()
        horizontal.compute_root().vectorize(x, 8)
        vertical.parallel(y)
        log = rg.Pipeline(vertical).schedule_log()
        self.assertEqual(len(log), log.size())
        self.assertEqual(rg.ScheduleLog.parse(log.to_text()), log)
        self.assertEqual(len(log.first(1)), 1)
        self.assertTrue(0 < len(log.of(horizontal.name())) < len(log))
        self.assertLess(len(log.without(0)), len(log))
        image, horizontal, vertical = blur()
        rg.Pipeline(vertical).apply_schedule(log)
        self.assertIn("parallel", vertical.loop_nest())

    def test_what_it_costs(self):
        image, horizontal, vertical = blur()
        horizontal.compute_root()
        report = rg.Pipeline(vertical).explain_schedule(HOST, [256, 256])
        self.assertGreater(report.predicted_ms, 0)
        self.assertIsNone(report.measured_ms)
        self.assertTrue({s.name for s in report.stages} >= {horizontal.name(), vertical.name()})
        self.assertIn("horizontal.compute_at(LoopLevel::root())", report.schedule)
        out = np.zeros((256, 256), np.float32)
        measured = rg.Pipeline(vertical).explain_schedule(HOST, out, rg.ExplainOptions(measure=True, seconds=0.05))
        self.assertGreater(measured.measured_ms, 0)
        self.assertTrue(out.any() and str(measured) and measured.to_json())

    def test_in_plain_words(self):
        image, horizontal, vertical = blur()
        horizontal.compute_root()
        vertical.vectorize(x, 8)
        text = rg.explain(vertical, [256, 256])
        self.assertRegex(text, r'"horizontal": \S+ ms, \d+ %, bound by \w+')
        self.assertIn("definition: y (256), x (32), vectors of 8 along x", text)
        self.assertRegex(text, r'stored: "horizontal" \(26\d kB\)')
        self.assertEqual(rg.explain([vertical], [[256, 256]]), text)
        seed = rg.Buffer(np.ones((256, 256), np.float32))
        gradient = rg.propagate_adjoints(vertical, seed)(image)
        self.assertIn("bound by", rg.explain(gradient, [257, 257]))
        self.assertGreater(gradient.explain_schedule(HOST, [257, 257]).predicted_ms, 0)

    def test_what_kernels_take(self):
        image, horizontal, vertical = blur()
        self.assertEqual(rg.explain_kernels(rg.Pipeline(vertical), HOST).kernels, [])
        xi, yi = rg.Var("xi"), rg.Var("yi")
        vertical.gpu_tile(x, y, xi, yi, 16, 8)
        horizontal.compute_at(vertical, x).gpu_threads(x, y)
        with_gpu = rg.Target("host-cuda-cuda_capability_80")
        report = rg.explain_kernels(rg.Pipeline(vertical), with_gpu)
        (kernel,) = report.kernels
        self.assertEqual(kernel.loops[0], f"{vertical.name()}: blocks y, x, threads yi, xi")
        scheduled = rg.Pipeline(vertical).explain_schedule(with_gpu, [64, 64])
        self.assertEqual(str(scheduled.kernels), str(report))
        self.assertEqual((kernel.threads % 16, kernel.local_bytes, report.notes), (0, 0, []))
        self.assertGreater(kernel.shared_bytes, 0)
        self.assertIn(kernel.name, str(report))
        if kernel.registers is not None:
            self.assertGreater(kernel.registers, 0)
            self.assertEqual((kernel.stack_bytes, kernel.spill_bytes), (0, 0))


if __name__ == "__main__":
    unittest.main()
