"""Rules of a user's own, and the checks of derivatives."""
import json
import threading
import unittest

import numpy as np
import retrograde as rg

x, i = rg.Var("x"), rg.Var("i")


class CustomRules(unittest.TestCase):
    def setUp(self):
        self.values = np.linspace(0.25, 1.5, 6, dtype=np.float32)
        self.image = rg.ImageParam("float32", 1, "image")
        self.image.set(self.values)

    def loss_with(self, rule):
        f, loss, r = rg.Func("f"), rg.Func("loss"), rg.RDom([(0, 6)])
        f[x] = rg.sin(self.image[x])
        rg.custom_adjoint(f, [self.image], rule)
        loss[()] += f[r] * rg.f32(r + 1)
        return loss

    def test_stand_for_the_definition(self):
        threads = []

        def rule(context):
            threads.append(threading.current_thread())
            self.assertTrue(context.wants(self.image))
            self.assertEqual(context.func().dimensions(), 1)
            self.assertEqual(len(context.region()), 1)
            self.assertEqual(len(context.region_of(self.image)), 1)
            adjoint = rg.Func("image_adj")
            adjoint[i] = context.adjoint()[i] * 3
            return [(self.image, adjoint)]

        d = rg.propagate_adjoints(self.loss_with(rule))
        np.testing.assert_array_equal(d(self.image).realize([6]), 3 * np.arange(1, 7))
        self.assertTrue(threads)
        self.assertIn("custom", d.explain(rg.Detail.All))

    def test_zero(self):
        for given in ((self.image, None), rg.AdjointContribution.zero(self.image)):
            d = rg.propagate_adjoints(self.loss_with(lambda context: [given]))
            self.assertFalse(np.any(d(self.image).realize([6])))

    def test_what_a_rule_raises_arrives(self):
        def rule(context):
            raise KeyError("of the rule")

        with self.assertRaisesRegex(KeyError, "of the rule"):
            rg.propagate_adjoints(self.loss_with(rule))
        with self.assertRaisesRegex(TypeError, "pairs of an input and a Func"):
            rg.propagate_adjoints(self.loss_with(lambda context: [3]))
        with self.assertRaisesRegex(rg.CompileError, "each wanted input gets a contribution"):
            rg.propagate_adjoints(self.loss_with(lambda context: []))

    def test_tangents(self):
        f = rg.Func("f")
        f[x] = rg.sin(self.image[x])

        def tangent(context):
            self.assertTrue(context.moves(self.image))
            t = rg.Func("t")
            t[i] = context.tangent(self.image)[i] * 5
            return t

        rg.custom_tangent(f, [self.image], tangent)
        rg.custom_adjoint(f, [self.image], lambda context: [(self.image, None)])
        t = rg.propagate_tangents(f, [(self.image, np.ones(6, np.float32))])
        np.testing.assert_array_equal(t(f).realize([6]), np.full(6, 5))


class Checks(unittest.TestCase):
    def loss(self):
        image, k = rg.ImageParam("float32", 1, "image"), rg.Param("float32", "k", 2.0)
        image.set(np.linspace(0.5, 2, 8, dtype=np.float32))
        f, loss, r = rg.Func("f"), rg.Func("loss"), rg.RDom([(0, 8)])
        f[x] = rg.exp(k * image[x]) / image[x]
        loss[()] += f[r]
        return loss, image, k

    def test_gradients(self):
        loss, image, k = self.loss()
        report = rg.check_gradients(loss, [], rg.GradientCheckOptions(directions=2, seed=3, wrt=[image]))
        self.assertLess(report.worst_error, 1e-7)
        self.assertEqual([given.name for given in report.inputs], ["image"])
        of = report.inputs[0]
        self.assertTrue(of.steps and of.methods and of.steps[0].richardson_error >= 0)
        self.assertLess(max(of.adjoint_error, of.complex_step_error, of.dot_product_error), 1e-7)
        self.assertTrue(0 < of.own_precision_error < 1e-3)
        self.assertTrue(all(f.error >= 0 and f.lost >= 0 and f.name for f in report.funcs))
        self.assertEqual(report.complex_step_refused, "")
        self.assertTrue(report.primal_seconds >= 0 and report.adjoint_seconds >= 0)
        self.assertIn("worst_error", json.loads(report.to_json()))
        self.assertIn("worst error", repr(report))
        self.assertEqual(len(rg.check_gradients(loss).inputs), 2)

    def test_gradients_of_what_is_not_bound(self):
        f = rg.Func("f")
        f[()] = rg.ImageParam("float32", 1, "unbound")[0]
        with self.assertRaisesRegex(rg.RuntimeError, "every input must be bound"):
            rg.check_gradients(f)

    def test_stability(self):
        loss, image, k = self.loss()
        options = rg.StabilityOptions(extremes=[rg.Extreme.Zeros], ranges=[rg.InputRange(image, 0.5, 1)], samples=1)
        report = rg.check_stability(loss, [], options)
        self.assertIn("as bound", [case.name for case in report.cases])
        zeros = next(case for case in report.cases if case.first_non_finite)
        self.assertTrue(zeros.first_non_finite.func)
        self.assertIn("/", zeros.first_non_finite.operation)
        bound = report.cases[0]
        self.assertIsNone(bound.first_lost)
        self.assertTrue(any(f.is_adjoint for f in bound.funcs))
        self.assertTrue(all(f.worst_error < 1e-4 and f.non_finite == 0 for f in bound.funcs))
        self.assertIn("cases", json.loads(report.to_json()))
        self.assertEqual(len(rg.StabilityOptions().extremes), 6)


if __name__ == "__main__":
    unittest.main()
