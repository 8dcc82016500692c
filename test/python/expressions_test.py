"""Expressions: what numbers become beside them, operators, functions."""
import math
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


def value(e):
    """What an expression without variables is."""
    f = rg.Func()
    f[()] = e
    return f.realize()[()]


class Numbers(unittest.TestCase):
    def test_alone_they_have_types_of_their_own(self):
        self.assertEqual(rg.Expr(3).type(), rg.Int(32))
        self.assertEqual(rg.Expr(2**40).type(), rg.Int(64))
        self.assertEqual(rg.Expr(2**63).type(), rg.UInt(64))
        self.assertEqual(rg.Expr(0.5).type(), rg.Float(32))
        self.assertEqual(rg.Expr(True).type(), rg.Bool())
        for overflowing in (2**64, -2**63 - 1):
            with self.assertRaises(OverflowError):
                rg.Expr(overflowing)

    def test_those_of_numpy_keep_their_types(self):
        for dtype in ("int8", "uint16", "int64", "float16", "float32", "float64", "bool"):
            self.assertEqual(str(rg.Expr(np.dtype(dtype).type(1)).type()), dtype)
        self.assertEqual((rg.f32(x) * np.float64(0.1)).type(), rg.Float(64))

    def test_beside_an_expr_they_take_its_type(self):
        for t in (rg.UInt(8), rg.Int(16), rg.Float(16), rg.Float(64)):
            e = rg.cast(t, x)
            for result in (e + 1, 1 + e, e * 2, rg.max(e, 3), rg.select(x > 0, e, 0)):
                self.assertEqual(result.type(), t)
        e = rg.f64(x)
        for result in (e * 0.1, 0.1 * e, rg.pow(e, 0.5), rg.max(e, 0.1), rg.clamp(e, 0.1, 0.2),
                       rg.select(x > 0, e, 0.1), rg.lerp(e, 0.25, 0.1)):
            self.assertEqual(result.type(), rg.Float(64))
        self.assertEqual((x * 0.5).type(), rg.Float(32))

    def test_a_float_beside_a_double_is_not_rounded_to_float32(self):
        self.assertEqual(value(rg.cast("float64", 1) * 0.1), 0.1)
        self.assertEqual(value(rg.max(rg.Expr(np.float64(0)), 0.1)), 0.1)

    def test_a_cast_float_is_rounded_once(self):
        self.assertEqual(value(rg.f64(0.1)), 0.1)
        self.assertEqual(value(rg.cast(rg.Float(64), 0.1)), 0.1)
        self.assertEqual(value(rg.cast("float16", 0.1)), float(np.float16(0.1)))
        self.assertEqual(value(rg.i64(2.0**53 - 1)), 2**53 - 1)
        self.assertEqual(value(rg.cast("int64", 16777217.0)), 16777217)
        self.assertEqual(value(rg.i64(2**62 + 1)), 2**62 + 1)
        self.assertEqual(value(rg.u64(2**63 + 1)), 2**63 + 1)
        self.assertEqual(value(rg.saturating_cast("uint32", 4294967295.0)), 2**32 - 1)
        self.assertEqual(value(rg.u32_sat(16777217.0)), 16777217)
        bits = int(np.float64(0.1).view("uint64"))
        self.assertEqual(value(rg.reinterpret("uint64", 0.1)), bits)
        self.assertEqual(value(rg.reinterpret("uint32", 0.1)), int(np.float32(0.1).view("uint32")))
        self.assertEqual(value(rg.reinterpret("float64", bits)), 0.1)

    def test_a_float_for_a_func_of_doubles_keeps_its_digits(self):
        declared = rg.Func(rg.Float(64), 1, "declared")
        declared[x] = 0.1
        self.assertEqual(declared.realize([1])[0], 0.1)
        started = rg.Func(rg.Float(64), 1, "started")
        started[x] += 0.1
        self.assertEqual(started.realize([1])[0], 0.1)
        both = rg.Func("both")
        both[x] = (rg.f64(x), rg.f64(x))
        both[x] += (0.1, 0.2)
        self.assertEqual([b[0] for b in both.realize([1])], [0.1, 0.2])

    def test_a_float_among_doubles_keeps_its_digits(self):
        e = rg.f64(0)
        self.assertEqual(value(rg.lerp(0.1, 0.2, e)), 0.1)
        self.assertEqual(value(rg.mux(0, [0.1, e])), 0.1)
        self.assertEqual(value(rg.unsafe_promise_clamped(rg.f64(0.1), 0.1, 0.2)), 0.1)
        chosen = rg.Func("chosen")
        chosen[()] = rg.select(rg.Expr(True), (0.1, 1), (e, rg.i64(2)))
        self.assertEqual([b[()] for b in chosen.realize()], [0.1, 1])
        points = rg.Func("points")
        points[x] = rg.f64(0)
        points[rg.scatter(0, 1)] = rg.gather(0.1, e)
        self.assertEqual(points.realize([2])[0], 0.1)
        pair = rg.Func("pair")
        pair[x] = (rg.f64(x), rg.f64(x))
        outside = rg.BoundaryConditions.constant_exterior(pair, (0.1, 0.2), [(0, 1)])
        self.assertEqual([b[3] for b in outside.realize([4])], [0.1, 0.2])

    def test_a_reduction_runs_over_a_domain_that_folds_away(self):
        r = rg.RDom([(0, 10)])
        f = rg.Func("f")
        f[()] = 1
        f[()] += 1 + r * 0
        self.assertEqual(f.realize()[()], 11)
        self.assertEqual(value(rg.sum(r * 0 + 1)), 10)

    def test_one_that_does_not_fit_is_of_a_type_that_holds_it(self):
        with self.assertRaisesRegex(rg.Error, "operands must be numbers"):
            x + rg.Expr("text")
        self.assertEqual((rg.cast("uint8", x) + 300).type(), rg.Int(32))


class Operators(unittest.TestCase):
    def test_arithmetic_is_that_of_cpp(self):
        for a, b in ((7, 2), (-7, 2), (7, -2), (-7, -2)):
            e = rg.Expr(a)
            self.assertEqual(value(e + b), a + b)
            self.assertEqual(value(b - e), b - a)
            self.assertEqual(value(e * b), a * b)
            self.assertEqual(value(e / b), rg_div(a, b))
            self.assertEqual(value(e // b), rg_div(a, b))
            self.assertEqual(value(e % b), a - b * rg_div(a, b))
            self.assertEqual(value(-e), -a)
            self.assertEqual(value(abs(e)), abs(a))

    def test_floor_division_of_floats_rounds_down(self):
        self.assertEqual(value(rg.Expr(-7.0) // 2), -4.0)
        self.assertEqual(value(rg.Expr(-7.0) / 2), -3.5)

    def test_bits(self):
        e = rg.Expr(12)
        self.assertEqual([value(v) for v in (e & 10, e | 3, e ^ 5, ~e, e << 2, e >> 1, 1 << rg.Expr(4))],
                         [8, 15, 9, -13, 48, 6, 16])

    def test_conditions(self):
        yes, no = rg.Expr(True), rg.Expr(False)
        self.assertEqual([value(v) for v in (yes & no, yes | no, yes ^ yes, ~yes)], [False, True, False, False])
        self.assertEqual(value(rg.logical_and(yes, rg.logical_not(no))), True)
        self.assertEqual([value(yes.logical_not()), value((rg.Expr(1) > 2).logical_not())], [False, True])
        self.assertEqual([value(v) for v in (rg.Expr(1) >= 2, rg.Expr(1) == 1, 3 != rg.Expr(3), 1 < rg.Expr(2))],
                         [False, True, False, True])

    def test_bool_raises_and_says_what_to_write(self):
        for e in (x, x == y, x < 3, rg.RDom([(0, 3)]), rg.Param("float32", "p")):
            with self.assertRaisesRegex(rg.CompileError, "known when a pipeline runs.*select"):
                bool(e)
        with self.assertRaises(rg.CompileError):
            0 < x < 5

    def test_an_expression_is_no_integer_of_python_and_says_what_to_write(self):
        image = rg.ImageParam("float32", 1, "image")
        for take in (range, int, [1, 2].__getitem__):
            with self.assertRaisesRegex(rg.CompileError, "known when a pipeline runs.*RDom"):
                take(image.dim(0).extent())
        self.assertEqual(value(rg.Expr(9) // 2), 9 // 2)  # sizes that are numbers and others divide alike

    def test_what_is_no_expression_is_a_type_error(self):
        for other in (None, [1], object(), {}):
            with self.assertRaises(TypeError):
                x + other

    def test_handles_are_compared_by_same_as(self):
        self.assertTrue(x.same_as(rg.Var("x")))
        self.assertFalse(x.same_as(y))
        e = x + 1
        self.assertTrue(e.same_as(e))
        self.assertEqual(len({e: 1, x + 1: 2}), 2)


def rg_div(a, b):
    """Rounds so that the remainder is never negative."""
    q = a // b
    return q if a - b * q >= 0 else q + 1


class Functions(unittest.TestCase):
    def test_of_real_numbers(self):
        for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "atan", "sinh", "cosh", "tanh", "asinh", "erf",
                     "floor", "ceil", "trunc"):
            for v in (0.25, 0.75):
                want = getattr(math, name)(v)
                self.assertAlmostEqual(value(getattr(rg, name)(rg.Expr(np.float64(v)))), want, delta=1e-14)
        for name in ("asin", "acos", "atanh"):
            self.assertAlmostEqual(value(getattr(rg, name)(rg.Expr(np.float64(0.5)))),
                                   getattr(math, name)(0.5), delta=1e-14)
        self.assertAlmostEqual(value(rg.acosh(rg.Expr(np.float64(1.5)))), math.acosh(1.5), delta=1e-14)
        self.assertAlmostEqual(value(rg.atan2(rg.Expr(np.float64(1)), 2)), math.atan2(1, 2), delta=1e-15)
        self.assertAlmostEqual(value(rg.hypot(rg.Expr(np.float64(3)), 4)), 5, delta=1e-14)
        self.assertEqual(value(rg.fract(rg.Expr(2.5))), 0.5)
        near_one = 1 + 2.0**-30
        self.assertEqual(value(rg.fma(rg.Expr(np.float64(near_one)), near_one, -1)), 2.0**-29 + 2.0**-60)
        self.assertEqual(value(rg.round(rg.Expr(2.5))), 2)

    def test_fast_ones_are_close(self):
        for fast, exact in (("fast_exp", "exp"), ("fast_log", "log"), ("fast_sin", "sin"), ("fast_cos", "cos")):
            self.assertAlmostEqual(value(getattr(rg, fast)(rg.Expr(0.7))), getattr(math, exact)(0.7), delta=1e-3)
        self.assertAlmostEqual(value(rg.fast_pow(rg.Expr(0.7), 2.5)), 0.7**2.5, delta=1e-3)
        self.assertAlmostEqual(value(rg.fast_inverse(rg.Expr(4.0))), 0.25, delta=1e-3)
        self.assertAlmostEqual(value(rg.fast_inverse_sqrt(rg.Expr(4.0))), 0.5, delta=1e-3)

    def test_classes_of_floats(self):
        inf, nan = rg.Expr(np.float32(np.inf)), rg.Expr(np.float32(np.nan))
        self.assertEqual([value(rg.is_nan(nan)), value(rg.is_inf(inf)), value(rg.is_finite(inf))],
                         [True, True, False])

    def test_choice(self):
        self.assertEqual(value(rg.select(rg.Expr(False), 1, rg.Expr(True), 2, 3)), 2)
        self.assertEqual(value(rg.mux(rg.Expr(1), [10, 20, 30])), 20)
        self.assertEqual(value(rg.clamp(rg.Expr(9), 0, 5)), 5)
        self.assertEqual(value(rg.min(rg.Expr(3), 1, 2)), 1)
        self.assertEqual(value(rg.lerp(rg.Expr(0.0), 10.0, 0.25)), 2.5)
        both = rg.select(rg.Expr(True), rg.Tuple(1, 2.0), rg.Tuple(3, 4.0))
        self.assertEqual([value(both[0]), value(both[1])], [1, 2.0])
        self.assertEqual(value(rg.tuple_select(rg.Expr(False), (1, 2), (3, 4))[1]), 4)

    def test_of_integers(self):
        u8 = lambda v: rg.Expr(np.uint8(v))
        cases = {
            rg.absd(u8(3), 5): 2, rg.popcount(u8(7)): 3, rg.count_leading_zeros(u8(1)): 7,
            rg.count_trailing_zeros(u8(8)): 3, rg.widening_mul(u8(200), 200): 40000,
            rg.widening_add(u8(200), 200): 400, rg.widening_sub(u8(1), 2): -1,
            rg.saturating_add(u8(200), 200): 255, rg.saturating_sub(u8(1), 2): 0,
            rg.halving_add(u8(255), 255): 255, rg.rounding_halving_add(u8(1), 2): 2,
            rg.halving_sub(u8(6), 2): 2, rg.div_round_to_zero(rg.Expr(-7), 2): -3,
            rg.mod_round_to_zero(rg.Expr(-7), 2): -1, rg.fast_integer_divide(u8(200), u8(7)): 28,
            rg.fast_integer_modulo(u8(200), u8(7)): 4,
            rg.fast_integer_divide_round_to_zero(rg.Expr(np.int16(-7)), u8(2)): -3,
            rg.concat_bits([u8(1), u8(2)]): 513, rg.extract_bits(rg.UInt(8), rg.Expr(513), 8): 2,
        }
        for e, want in cases.items():
            self.assertEqual(value(e), want, str(e))

    def test_types(self):
        self.assertEqual(value(rg.u8(rg.Expr(300))), 44)
        self.assertEqual(value(rg.u8_sat(rg.Expr(300))), 255)
        self.assertEqual(value(rg.saturating_cast("int8", rg.Expr(-300))), -128)
        self.assertEqual(value(rg.reinterpret(rg.UInt(32), rg.Expr(1.0))), 0x3F800000)
        for name in ("i8", "i16", "i32", "i64", "u8", "u16", "u32", "u64"):
            self.assertEqual(getattr(rg, name)(x).type(), getattr(rg, name + "_sat")(x).type())
        self.assertEqual([str(f(x).type()) for f in (rg.f16, rg.bf16, rg.f32, rg.f64)],
                         ["float16", "bfloat16", "float32", "float64"])

    def test_random_numbers_depend_on_the_point_and_the_seed(self):
        f = rg.Func()
        f[x] = (rg.random_float(1), rg.random_uint(2), rg.random_int())
        floats, uints, ints = (np.asarray(b) for b in f.realize([1000]))
        self.assertTrue(0 <= floats.min() and floats.max() < 1 and len(set(floats)) > 990)
        self.assertEqual((uints.dtype, ints.dtype), (np.uint32, np.int32))

    def test_hints_keep_values(self):
        for hint in (rg.likely, rg.likely_if_innermost, rg.strict_float, rg.stop_gradient):
            self.assertEqual(value(hint(rg.Expr(2.5))), 2.5)
        self.assertEqual(value(rg.unsafe_promise_clamped(rg.Expr(2), 0, 5)), 2)
        self.assertEqual(value(rg.unsafe_promise_clamped(rg.Expr(2), None, 5)), 2)
        self.assertEqual(value(rg.straight_through(rg.round(rg.Expr(2.75)), rg.Expr(2.75))), 3)


class Texts(unittest.TestCase):
    def test_repr_shows_what_it_is(self):
        self.assertEqual(repr(x), "Var('x')")
        self.assertEqual(repr(x + 1), "<retrograde.Expr int32 x + 1>")
        self.assertEqual(str(rg.f32(x) * 2), "float32(x) * 2f")
        self.assertEqual(repr(rg.Expr()), "<retrograde.Expr undefined>")
        self.assertEqual(repr(rg.Tuple(x, 1)), "<retrograde.Tuple (x, 1)>")
        self.assertIn("r.x", repr(rg.RDom([(0, 3), (0, 4)], "r")))
        self.assertEqual(repr(rg.Float(32)), "<retrograde.Type float32>")

    def test_docstrings_are_the_headers_comments(self):
        self.assertIn("half to even", rg.round.__doc__)
        self.assertIn("Requires: only a variable of an RDom has a range", rg.RVar.min.__doc__)
        self.assertIn("for y:", rg.Func.compute_at.__doc__)


if __name__ == "__main__":
    unittest.main()
