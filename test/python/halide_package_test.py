"""Programs that say `import halide as hl`: what Halide's package does otherwise than ours."""
import contextlib
import io
import os
import subprocess
import sys
import unittest
import warnings

import numpy as np
import retrograde

sys.path.insert(0, os.path.join(os.path.dirname(retrograde.__file__), "compat"))
import halide as hl  # noqa: E402
import halide.imageio  # noqa: E402

x = hl.Var("x")


def stdout_of(call):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        call()
    return out.getvalue()


class HalidePackage(unittest.TestCase):
    def test_has_the_names_of_ours(self):
        f = hl.Func("f")
        f[x] = hl.max(x, 3) + hl.sum(hl.RDom([(0, 4)]).x)
        np.testing.assert_array_equal(np.asarray(f.realize([5])), [9, 9, 9, 9, 10])
        self.assertIs(hl.imageio.imread, retrograde.imageio.imread)

    def test_reprs(self):
        self.assertEqual(repr(x), "<halide.Var 'x'>")
        self.assertEqual(repr(hl.Int(32, 8)), "<halide.Type int32x8>")
        self.assertEqual(repr(hl.Target("x86-64-linux")), "<halide.Target x86-64-linux>")
        self.assertEqual(repr(hl.Expr(x) + 1), "<halide.Expr of type int32: x + 1>")
        self.assertEqual(repr(hl.Func("shown")), "<halide.Func 'shown'>")
        self.assertTrue(repr(hl.Buffer(hl.UInt(8), [3])).startswith("<halide.Buffer "))

    def test_prints_go_to_stdout_of_python(self):
        f = hl.Func("f")
        f[x] = hl.print_when(x == 3, x * x, "is the square of", x)
        self.assertEqual(stdout_of(lambda: f.realize([5])), "9 is the square of 3\n")

    def test_warnings_go_to_stdout_of_python(self):
        f = hl.Func("warned")
        f[x] = 0
        f[x] += 5
        f.vectorize(x, 8)
        self.assertRegex(stdout_of(lambda: f.realize([16])), '^Warning: update 0 of "warned" has no schedule.*\\n$')

    def test_rounding_is_a_warning(self):
        def count(make):
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                make()
            return sum(issubclass(w.category, RuntimeWarning) for w in told)
        self.assertEqual(count(lambda: x + 0.1), 1)
        for exact in (lambda: x + 0.75, lambda: x + hl.f64(0.1), lambda: hl.f64(x) * 0.1, lambda: x + float("nan")):
            self.assertEqual(count(exact), 0)

    def test_variables_of_a_domain_are_numbered_from_0(self):
        r = hl.RDom([(0, 4), (0, 3)])
        self.assertEqual(r[1].name(), r.y.name())
        for index in (-1, 2):
            with self.assertRaises(KeyError):
                r[index]
        with self.assertRaises(TypeError):
            r["x"]

    def test_argmin_is_a_tuple(self):
        r, f = hl.RDom([(0, 4)]), hl.Func("f")
        least = hl.argmin(hl.abs(r.x - 2))
        self.assertIs(type(least), tuple)
        f[()] = least[0]
        self.assertEqual(f.realize()[()], 2)

    def test_a_process_that_does_not_import_it_is_as_before(self):
        program = "import retrograde as rg; print(repr(rg.Var('x')), rg.Var('x') + 0.1 is None)"
        done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True)
        self.assertEqual((done.stdout, done.stderr), ("Var('x') False\n", ""))


if __name__ == "__main__":
    unittest.main()
