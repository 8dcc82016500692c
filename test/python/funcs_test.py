"""Funcs: definitions, updates, Tuples, reductions, boundary conditions, and what is known of them."""
import unittest

import numpy as np
import retrograde as rg

x, y, c = rg.Var("x"), rg.Var("y"), rg.Var("c")


def array(f, *sizes, **more):
    return np.asarray(f.realize(list(sizes), **more))


class Names(unittest.TestCase):
    def test_several_at_once(self):
        a, b = rg.vars("a b")
        self.assertEqual((a.name(), b.name()), ("a", "b"))
        first, second = rg.funcs("first, second")
        first[a] = a
        second[a] = first[a] * 2
        np.testing.assert_array_equal(array(second, 3), [0, 2, 4])

    def test_indices_from_the_end(self):
        f, r = rg.Func("f"), rg.RDom([(0, 2), (0, 3)])
        f[x] = (x, x * 2)
        f[x][-1] = x * 3
        g = rg.Func("g")
        g[x] = f[x][-1] - f[x][-2]
        np.testing.assert_array_equal(array(g, 3), [0, 2, 4])
        self.assertEqual(r[-1].name(), r.y.name())
        for index in (2, -3):
            with self.assertRaises(IndexError):
                r[index]
            with self.assertRaises(IndexError):
                f[x][index]

    def test_inlining_at_once(self):
        f, g = rg.Func("f"), rg.Func("g")
        f[x] = x * x
        g[x] = f[x] + f[x + 1]
        g.eager_inline(f)
        self.assertNotIn(f.name(), str(g.value()))
        np.testing.assert_array_equal(array(g, 3), [1, 5, 13])


class Definitions(unittest.TestCase):
    def test_the_axes_of_an_array_are_the_dimensions_in_reverse(self):
        f = rg.Func("f")
        f[x, y, c] = x + 10 * y + 100 * c
        a = array(f, 4, 3, 2)
        self.assertEqual(a.shape, (2, 3, 4))
        for at in np.ndindex(2, 3, 4):
            self.assertEqual(a[at], at[2] + 10 * at[1] + 100 * at[0])

    def test_updates(self):
        f = rg.Func("f")
        r = rg.RDom([(1, 9)], "r")
        f[x] = 1
        f[r] = f[r - 1] * 2
        f[x] += 3
        f[x] -= 1
        f[x] *= 2
        f[5] = 0
        want = 2 * (2 ** np.arange(10) + 2)
        want[5] = 0
        np.testing.assert_array_equal(array(f, 10), want)
        self.assertEqual(f.num_update_definitions(), 5)

    def test_an_update_of_an_undefined_func_starts_from_its_identity(self):
        total, product = rg.Func(), rg.Func()
        r = rg.RDom([(1, 5)])
        total[()] += rg.f32(r)
        product[()] *= r
        self.assertEqual(total.realize()[()], 15.0)
        self.assertEqual(product.realize()[()], 120)

    def test_numbers_take_the_type_that_a_func_has(self):
        f = rg.Func()
        f[x] = rg.f64(0)
        f[x] += 0.1
        f[0] = 1
        a = array(f, 2)
        self.assertEqual((a.dtype, a[0], a[1]), (np.float64, 1.0, 0.1))

    def test_what_plus_gave_back_belongs_to_its_func(self):
        f, g = rg.Func(), rg.Func()
        f[x] = 1
        ref = f[x]
        ref += 1
        with self.assertRaises(TypeError):
            g[x] = ref

    def test_placeholders(self):
        f, g = rg.Func(), rg.Func()
        f[x, y] = x + 10 * y
        g[...] = f[...] + 1
        np.testing.assert_array_equal(array(g, 3, 2), array(f, 3, 2) + 1)
        h = rg.Func()
        h[x, rg._] = f[x, rg._] * 2
        np.testing.assert_array_equal(array(h, 3, 2), array(f, 3, 2) * 2)
        self.assertEqual(rg._0.name(), "_0")

    def test_tuples(self):
        f = rg.Func("f")
        f[x] = (x, rg.f32(x) / 2)
        f[x][1] += 1
        f[2] = (f[2][0] + 40, 0)
        whole, half = f.realize([4])
        np.testing.assert_array_equal(whole, [0, 1, 42, 3])
        np.testing.assert_array_equal(half, [1, 1.5, 0, 2.5])
        self.assertEqual((f.outputs(), len(f[x]), len(f.values())), (2, 2, 2))
        self.assertEqual([str(t) for t in f.types()], ["int32", "float32"])
        g = rg.Func()
        g[x] = f[x + 1]
        np.testing.assert_array_equal(g.realize([2])[0], [1, 42])

    def test_objects_with_elements_are_tuples(self):
        class Complex:
            def __init__(self, real, imaginary):
                self.parts = real, imaginary

            def __len__(self):
                return 2

            def __getitem__(self, i):
                return self.parts[i]

        f, g = rg.Func(), rg.Func()
        f[x] = Complex(1.5, rg.f32(x))
        f[x] += Complex(2.0, 3.0)
        real, imaginary = f.realize([3])
        self.assertEqual((real[2], imaginary[2]), (3.5, 5))
        for none in ({0: 1}, np.ones(2), object()):
            with self.assertRaises((TypeError, RuntimeError)):
                g[x] = none

    def test_of_expressions_images_and_lambdas(self):
        a = np.arange(6, dtype=np.uint8).reshape(2, 3)
        np.testing.assert_array_equal(array(rg.Func(rg.Buffer(a)), 3, 2), a)
        self.assertEqual(rg.Func(rg.Expr(7)).realize()[()], 7)
        np.testing.assert_array_equal(array(rg.lambda_(x, y, x * y), 3, 3), np.outer(range(3), range(3)))
        self.assertIs(rg.lambda_func, rg.lambda_)

    def test_declared_types_are_kept(self):
        f = rg.Func(rg.Float(32), 1, "f")
        with self.assertRaisesRegex(rg.CompileError, "declared with|same types"):
            f[x, y] = 0.0

    def test_scatter_and_gather(self):
        f = rg.Func()
        f[x] = x
        f[rg.scatter(0, 1)] = rg.gather(f[1], f[0])
        np.testing.assert_array_equal(array(f, 3), [1, 0, 2])


class Facts(unittest.TestCase):
    def test_of_a_func(self):
        f = rg.Func("facts")
        self.assertFalse(f.defined())
        f[x, y] = rg.f32(x)
        f[x, 0] = 2.0
        self.assertEqual((f.name(), f.dimensions(), f.defined()), ("facts", 2, True))
        self.assertEqual([v.name() for v in f.args()], ["x", "y"])
        self.assertEqual((str(f.value()), str(f.update_value()), str(f.update_args()[1])), ("float32(x)", "2f", "0"))
        self.assertTrue(f.has_update_definition())
        self.assertEqual((f.type(), f.output_types()), (rg.Float(32), [rg.Float(32)]))
        self.assertFalse(f.is_extern())
        self.assertTrue(f.same_as(f.update() and f))
        self.assertEqual(repr(f), "<retrograde.Func facts(x, y) of float32, 1 update>")

    def test_it_knows_the_line_that_declared_it(self):
        f = rg.Func("f")
        self.assertRegex(f.source_location(), r"funcs_test\.py:\d+$")

    def test_reduction_domains(self):
        r = rg.RDom([(0, 3), (1, 4)], "box")
        self.assertEqual((r.dimensions(), len(r), [v.name() for v in r]), (2, 2, ["box.x", "box.y"]))
        self.assertEqual((str(r.y.min()), str(r[1].extent())), ("1", "4"))
        f = rg.Func()
        f[x] = 0
        f[r.x] += r.y
        self.assertEqual([v.name() for v in f.rvars()], ["box.x", "box.y"])
        np.testing.assert_array_equal(array(f, 3), [10, 10, 10])
        image = np.ones((2, 5), np.float32)
        self.assertEqual(str(rg.RDom(rg.Buffer(image)).x.extent()), "5")
        self.assertEqual(rg.RDom(image).dimensions(), 2)
        with self.assertRaises(IndexError):
            r[2]

    def test_where(self):
        r = rg.RDom([(0, 4), (0, 4)])
        r.where(r.x < r.y)
        f = rg.Func()
        f[()] += 10 * r.y + r.x
        self.assertEqual(f.realize()[()], sum(10 * j + i for i in range(4) for j in range(4) if i < j))


class Reductions(unittest.TestCase):
    def setUp(self):
        self.a = np.array([[3, 1, 4], [1, 5, 9]], np.int32)
        self.b, self.r = rg.Buffer(self.a), rg.RDom([(0, 3), (0, 2)])

    def of(self, reduction, *args):
        f = rg.Func()
        f[()] = reduction(*args)
        got = f.realize()
        return [b[()] for b in got] if isinstance(got, tuple) else got[()]

    def test_all(self):
        e, r = self.b[self.r.x, self.r.y], self.r
        self.assertEqual(self.of(rg.sum, e), 23)
        self.assertEqual(self.of(rg.sum, r, e, "named"), 23)
        self.assertEqual(self.of(rg.product, e), 540)
        self.assertEqual(self.of(rg.maximum, e), 9)
        self.assertEqual(self.of(rg.minimum, e), 1)
        self.assertEqual(self.of(rg.saturating_sum, rg.u8(e * 30)), 255)
        self.assertEqual(self.of(rg.argmax, e), [2, 1, 9])
        self.assertEqual(self.of(rg.argmin, e), [1, 0, 1])

    def test_the_func_that_is_given_is_the_one_to_schedule(self):
        f, total = rg.Func(), rg.Func("total")
        f[()] = rg.sum(self.b[self.r.x, self.r.y], total)
        total.compute_root()
        self.assertIn("total", f.loop_nest())
        self.assertEqual(f.realize()[()], 23)


class BoundaryConditions(unittest.TestCase):
    def check(self, func, want):
        f = rg.Func()
        f[x] = func[x - 3]
        np.testing.assert_array_equal(array(f, 10), want)

    def test_of_arrays_funcs_and_images(self):
        a = np.array([1, 2, 3, 4], np.int32)
        image = rg.ImageParam(rg.Int(32), 1)
        image.set(a)
        f = rg.Func()
        f[x] = x + 1
        bc = rg.BoundaryConditions
        for source, bounds in ((a, None), (rg.Buffer(a), None), (image, None), (f, [(0, 4)])):
            more = [bounds] if bounds else []
            self.check(bc.repeat_edge(source, *more), [1, 1, 1, 1, 2, 3, 4, 4, 4, 4])
            self.check(bc.repeat_image(source, *more), [2, 3, 4, 1, 2, 3, 4, 1, 2, 3])
            self.check(bc.mirror_image(source, *more), [3, 2, 1, 1, 2, 3, 4, 4, 3, 2])
            self.check(bc.mirror_interior(source, *more), [4, 3, 2, 1, 2, 3, 4, 3, 2, 1])
            self.check(bc.constant_exterior(source, 9, *more), [9, 9, 9, 1, 2, 3, 4, 9, 9, 9])
        with self.assertRaises(TypeError):
            bc.repeat_edge(f)

    def test_arguments_go_by_the_names_of_halide(self):
        bc = rg.BoundaryConditions
        f = rg.Func()
        f[x] = x + 1
        self.check(bc.constant_exterior(f=f, exterior=9, bounds=[(0, 4)]), [9, 9, 9, 1, 2, 3, 4, 9, 9, 9])
        self.check(bc.mirror_interior(f=f, bounds=[(0, 4)]), [4, 3, 2, 1, 2, 3, 4, 3, 2, 1])


if __name__ == "__main__":
    unittest.main()
