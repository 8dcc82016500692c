"""Params and ImageParams."""
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


class Params(unittest.TestCase):
    def test_values(self):
        gain = rg.Param(rg.Float(32), "gain", 2.0)
        f = rg.Func()
        f[x] = x * gain
        np.testing.assert_array_equal(f.realize([3]), [0, 2, 4])
        gain.set(0.5)
        np.testing.assert_array_equal(f.realize([3]), [0, 0.5, 1])
        np.testing.assert_array_equal(f.realize([3], param_map={gain: 3}), [0, 3, 6])
        self.assertEqual((gain.get(), gain.name(), gain.type()), (0.5, "gain", rg.Float(32)))
        self.assertEqual(repr(gain), '<retrograde.Param "gain" float32>')

    def test_every_type(self):
        for name in ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float16",
                     "float32", "float64"):
            value = 1 if name == "bool" else 2**63 + 1 if name == "uint64" else 77
            p, f = rg.Param(name, "p", value), rg.Func()
            f[()] = p
            self.assertEqual((p.get(), f.realize()[()]), (value, value))

    def test_values_that_do_not_fit(self):
        p = rg.Param("uint8", "p")
        for value, error in ((256, OverflowError), (-1, OverflowError), (1.5, TypeError), ("1", TypeError)):
            with self.assertRaises(error):
                p.set(value)
        with self.assertRaisesRegex(rg.CompileError, "value"):
            p.get()

    def test_limits(self):
        p = rg.Param("int32", "n", 5, 1, 9)
        f = rg.Func()
        f[x] = x + p
        self.assertEqual((str(p.min_value()), str(p.max_value())), ("1", "9"))
        p.set(10)
        with self.assertRaisesRegex(rg.RuntimeError, "keep its limits"):
            f.realize([1])
        p.set_range(0, 100)
        p.set_min_value(5)
        p.set_max_value(50)
        p.set_estimate(20)
        self.assertEqual(f.realize([1])[0], 10)


class ImageParams(unittest.TestCase):
    def test_set_get_reset(self):
        image = rg.ImageParam(rg.Float(32), 2, "image")
        a = np.arange(6, dtype=np.float32).reshape(2, 3)
        image.set(a)
        self.assertTrue(np.shares_memory(np.asarray(image.get()), a))
        self.assertEqual((image.name(), image.dimensions(), image.type()), ("image", 2, rg.Float(32)))
        f = rg.Func()
        f[x, y] = image[x, y] + image(0, 0)
        np.testing.assert_array_equal(f.realize([3, 2]), a + a[0, 0])
        image.reset()
        with self.assertRaisesRegex(rg.RuntimeError, "needs a buffer"):
            f.realize([3, 2])

    def test_an_array_lives_as_long_as_it_is_set(self):
        image = rg.ImageParam("int32", 1)
        image.set(np.arange(1000, dtype=np.int32) * 3)
        f = rg.Func()
        f[x] = image[x]
        np.testing.assert_array_equal(f.realize([1000]), np.arange(1000) * 3)

    def test_facts_and_promises(self):
        image = rg.ImageParam("uint8", 3, "image")
        for e in (image.left(), image.right(), image.top(), image.bottom(), image.width(), image.height(),
                  image.channels(), image.dim(2).stride(), image.dim(1).max(), image.dim(0).dim(1).extent()):
            self.assertEqual(e.type(), rg.Int(32))
        image.dim(2).set_bounds(0, 3).set_stride(1)
        image.dim(0).set_min(0).set_extent(8).set_estimate(0, 8)
        image.set_estimates([(0, 8), (0, 8), (0, 3)])
        image.set_host_alignment(1)
        self.assertEqual((str(image.dim(0).extent_estimate()), image.host_alignment()), ("8", 1))
        image.promise_finite()

    def test_infer_input_bounds(self):
        image = rg.ImageParam("float32", 1, "image")
        f = rg.Func()
        f[x] = image[x] + image[x + 2]
        f.infer_input_bounds([10])
        self.assertEqual(image.get().extent(0), 12)

    def test_the_func_of_an_image_and_its_wrappers(self):
        image = rg.ImageParam("int32", 1, "image")
        f = rg.Func("f")
        f[x] = image[x] + image[x + 1]
        image.in_(f).compute_root()
        image.set(np.arange(5, dtype=np.int32))
        np.testing.assert_array_equal(f.realize([4]), [1, 3, 5, 7])
        self.assertIn("image", f.loop_nest())


if __name__ == "__main__":
    unittest.main()
