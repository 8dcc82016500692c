"""Errors are exceptions of Python with the four parts of their messages."""
import builtins
import math
import pickle
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


class Classes(unittest.TestCase):
    def test_programs_catch_them_as_what_they_are(self):
        self.assertTrue(issubclass(rg.CompileError, rg.UserError) and issubclass(rg.UserError, rg.Error))
        self.assertTrue(issubclass(rg.RuntimeError, builtins.RuntimeError))
        self.assertTrue(issubclass(rg.Unsupported, NotImplementedError))

    def test_four_parts(self):
        f = rg.Func("f")
        f[x] = 0
        r = rg.RDom([(1, 9)], "r")
        f[r] = f[r - 1] + 1
        with self.assertRaises(rg.CompileError) as caught:
            f.update().vectorize(r)
        error = caught.exception
        self.assertRegex(error.asked, 'vectorize "f.*" over "r')
        self.assertIn("same element", error.rule)
        self.assertTrue(error.evidence and error.instead)
        for part in (error.asked, error.rule, error.evidence):
            self.assertIn(part, str(error))

    def test_names_are_those_of_the_program(self):
        def program(first, second):
            f, g = rg.Func(first), rg.Func(second)
            f[x], g[x] = x, x
            f[x] = f[x - 1] + g[x]

        for _ in range(2):  # the second program's Funcs have numbers
            with self.assertRaises(rg.CompileError) as caught:
                program("once_named", "other")
            self.assertIn('"once_named"(x)', caught.exception.asked)
            self.assertNotIn("$", str(caught.exception) + caught.exception.evidence)
        both = rg.Func("alike"), rg.Func("alike")
        both[0][x] = x
        with self.assertRaisesRegex(rg.CompileError, r'"alike\$\d+"'):  # which of the two matters
            both[0].compute_at(both[1], x)
            both[1][x] = both[0][x]
            rg.Func("reader")[x] = both[1][x]
            both[0].compute_at(both[1], y)
            both[1].realize([3])

    def test_a_recurrence_that_starts_outside_of_its_output(self):
        f, image, r = rg.Func("f"), rg.ImageParam("float32", 1, "image"), rg.RDom([(0, 8)])
        f[x] = 0.0
        f[r] = f[r - 1] / 2 + image[r]
        f.output_buffer().dim(0).set_bounds(0, 8)
        image.set(np.ones(8, np.float32))
        with self.assertRaisesRegex(rg.RuntimeError, r"used over \[-1, 7\].*If an update reads elements of \"f\""):
            f.realize(np.zeros(8, np.float32))

    def test_a_sum_of_floats_that_starts_as_an_integer(self):
        f, image = rg.Func("f"), rg.ImageParam("float32", 1, "image")
        f[x] = 0
        for add in (lambda: f[x].__iadd__(image[x]), lambda: f[x].__iadd__(0.5)):
            with self.assertRaisesRegex(rg.CompileError, "in Python 0.0") as caught:
                add()
            self.assertIn("the first definition gives int32 and this one float32", caught.exception.evidence)
        f[x] += 1

    def test_errors_of_calls_carry_their_code(self):
        image = rg.ImageParam("float32", 1, "image")
        f = rg.Func("f")
        f[x] = image[x + 5]
        image.set(np.zeros(4, np.float32))
        with self.assertRaisesRegex(rg.RuntimeError, "image") as caught:
            f.realize([4])
        self.assertNotEqual(caught.exception.code, 0)

    def test_unsupported(self):
        f = rg.Func("f")
        f[x] = 0
        with self.assertRaisesRegex(rg.Unsupported, "generated for CUDA"):
            f.gpu_blocks(x, rg.DeviceAPI.OpenCL)

    def test_they_can_be_pickled(self):
        try:
            rg.Func("f").realize([1])
        except rg.Error as error:
            again = pickle.loads(pickle.dumps(error))
            self.assertEqual((type(again), str(again), again.rule), (type(error), str(error), error.rule))


class WhatHasNoEnd(unittest.TestCase):
    """Funcs and images have elements at all coordinates, so there is no end to iterate to."""

    def test_iteration_is_refused(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x]
        for thing, name in ((image, 'ImageParam "image"'), (f, 'Func "f')):
            for use in (list, sum, max, iter, lambda thing: (lambda a, b: a)(*thing)):
                with self.assertRaisesRegex(TypeError, "cannot iterate over the " + name) as caught:
                    use(thing)
                self.assertTrue("RDom" in caught.exception.instead and caught.exception.rule)
            with self.assertRaisesRegex(TypeError, "cannot search the " + name):
                1 in thing

    def test_what_has_an_end_is_iterated_over(self):
        f, r, buffer = rg.Func("f"), rg.RDom([(0, 3), (0, 2)]), rg.Buffer(np.arange(3, dtype="int32"))
        f[x] = (x, 2 * x)
        first, second = f[x]
        self.assertEqual((first.index(), second.index()), (0, 1))
        self.assertEqual((len(list(r)), list(buffer), 2 in buffer), (2, [0, 1, 2], True))
        with self.assertRaises(rg.CompileError):
            list(rg.Buffer(np.zeros((2, 3), "float32")))


class FunctionsOfOtherLibraries(unittest.TestCase):
    """They take values; the error names the function to write."""

    def test_are_refused(self):
        f = rg.Func("f")
        f[x] = rg.f32(x)
        for e in (f[x], rg.f32(x), rg.Param("float32", "gain")):
            for use, words in ((math.sqrt, r"rg\.sqrt"), (np.exp, r"rg\.exp"), (np.log1p, "of this package"),
                               (np.arctan2, r"rg\.atan2")):
                with self.assertRaisesRegex(TypeError, words):
                    use(e, 1) if use is np.arctan2 else use(e)
            with self.assertRaisesRegex(TypeError, r"rg\.max"):
                np.maximum(e, 0)

    def test_operators_of_numpy_work(self):
        f, r = rg.Func("f"), rg.RDom([(0, 3)], "r")
        f[x] = rg.f32(x)
        for e in (f[x], r, rg.f32(x)):
            self.assertIsInstance(np.float64(0.5) * e, rg.Expr)
            self.assertIsInstance(np.abs(e), rg.Expr)
            both = np.array([1.0, 2.0]) * e
            self.assertEqual((both.shape, type(both[1])), ((2,), rg.Expr))


class Advice(unittest.TestCase):
    """Advice is in Python's syntax."""

    def test_of_errors(self):
        f, image = rg.Func("f"), rg.ImageParam("float32", 1, "image")
        for use, words in (
                (lambda: rg.RDom([(0, 8 / 2)]), "integers with //.*rg.i32"),
                (lambda: image[rg.floor(x / 2.0)], r"rg\.i32\(rg\.floor\(e\)\) or rg\.i32\(rg\.round\(e\)\)"),
                (lambda: f.__setitem__((), image[rg.RDom([(0, 8)])]), r"f\[x\] \+= \.\.\., .*rg\.sum\(")):
            with self.assertRaisesRegex(rg.CompileError, words) as caught:
                use()
            self.assertRegex(caught.exception.instead, words)
            self.assertNotRegex(str(caught.exception), "cast<")

    def test_of_texts(self):
        from retrograde._errors import in_python
        for theirs, ours in (
                ("Define it first, as in f(x) = 0", "Define it first, as in f[x] = 0"),
                ("Sum them, as in loss() += f(r.x, r.y)", "Sum them, as in loss[()] += f[r.x, r.y]"),
                ("Write f(scatter(a, b)) = gather(u, v)", "Write f[rg.scatter(a, b)] = rg.gather(u, v)"),
                ("Use AdjointOptions{.overwritten = Overwritten::Store}",
                 "Use rg.AdjointOptions(overwritten=rg.Overwritten.Store)"),
                ("Name Target::CUDA", "Name rg.Target.CUDA"),
                ("Convert them: cast<int>(...)", "Convert them: rg.i32(...)"),
                ("Give 0 or more", "Give 0 or more")):
            self.assertEqual(in_python(f"cannot do: no; so. {theirs}.", theirs), (f"cannot do: no; so. {ours}.", ours))


class OnTheWayIn(unittest.TestCase):
    """What conversions of arguments find is told, not hidden behind 'incompatible arguments'."""

    def test_a_func_that_is_read_before_it_is_defined(self):
        f = rg.Func("later")
        for use in (lambda: rg.sqrt(f[x]), lambda: f[x] + 1, lambda: rg.select(f[x] > 0, 1, 2), lambda: rg.Expr(f[x])):
            with self.assertRaisesRegex(rg.CompileError, "later.*defined"):
                use()

    def test_arrays_that_are_none_of_numbers(self):
        f = rg.Func("f")
        f[x] = 0
        with self.assertRaisesRegex(rg.CompileError, "numbers in the order of bytes"):
            f.realize(np.zeros(3, "complex128"))

    def test_wrong_types_of_arrays(self):
        f = rg.Func("f")
        f[x] = 0
        with self.assertRaisesRegex(rg.RuntimeError, "right element type"):
            f.realize(np.zeros(3, np.float32))
        with self.assertRaisesRegex(rg.RuntimeError, "number of dimensions"):
            f.realize(np.zeros((3, 3), np.int32))
        image = rg.ImageParam("float32", 2)
        with self.assertRaisesRegex(rg.CompileError, "elements are of the parameter's type"):
            image.set(np.zeros((3, 3)))

    def test_coordinates(self):
        f = rg.Func("f")
        f[x] = 0
        with self.assertRaisesRegex(TypeError, "a coordinate is"):
            f[1:2]
        with self.assertRaises(rg.CompileError):
            rg.Expr(f[0.5])
        with self.assertRaisesRegex(rg.CompileError, "one coordinate for each dimension"):
            rg.Expr(f[1, 2])


if __name__ == "__main__":
    unittest.main()
