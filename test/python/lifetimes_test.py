"""Who keeps whom alive, and that nothing is kept for ever."""
import gc
import resource
import sys
import unittest
import weakref

import numpy as np
import retrograde as rg

x = rg.Var("x")


class Kept(unittest.TestCase):
    """Arrays stay as long as anything in C++ can reach their memory."""

    def array(self):
        class Array(np.ndarray):
            pass

        a = np.arange(1000, dtype=np.float32).view(Array)
        return a, weakref.ref(a)

    def check(self, use):
        a, alive = self.array()
        kept = use(a)
        del a
        gc.collect()
        self.assertIsNotNone(alive())
        result = kept if callable(kept) else None
        if result:
            np.testing.assert_array_equal(result(), np.arange(1000, dtype=np.float32))
        del kept, result
        gc.collect()
        self.assertIsNone(alive())

    def test_by_a_buffer_and_what_is_made_of_it(self):
        self.check(lambda a: (lambda b: lambda: np.asarray(b))(rg.Buffer(a)))
        for derive in (lambda b: b.cropped(0, 0, 1000), lambda b: b.alias(), lambda b: b.embedded(1).sliced(1),
                       lambda b: b.translated(0, 3), lambda b: b.embedded(1).transposed(0, 1).sliced(0)):
            self.check(lambda a: (lambda b: lambda: np.asarray(b))(derive(rg.Buffer(a))))

    def test_by_an_expression_a_func_and_a_gradient(self):
        def func(a):
            f = rg.Func()
            f[x] = rg.Buffer(a)[x]
            return lambda: f.realize([1000])

        self.check(func)

        def expression(a):
            e = rg.Buffer(a)[x]
            def run():
                f = rg.Func()
                f[x] = e
                return f.realize([1000])
            return run

        self.check(expression)

    def test_by_a_view_of_numpy(self):
        self.check(lambda a: (lambda v: lambda: v)(np.asarray(rg.Buffer(a))))

    def test_by_an_image_param(self):
        image = rg.ImageParam("float32", 1)
        a, alive = self.array()
        image.set(a)
        del a
        gc.collect()
        self.assertIsNotNone(alive())
        image.reset()
        gc.collect()
        self.assertIsNone(alive())


class NotKept(unittest.TestCase):
    def test_calls_let_go_of_their_arguments(self):
        f, image = rg.Func(), rg.ImageParam("float32", 1)
        f[x] = image[x]
        a, out = np.zeros(10, np.float32), np.zeros(10, np.float32)
        before = sys.getrefcount(a), sys.getrefcount(out)
        for _ in range(20):
            f.realize(out, param_map={image: a})
        self.assertEqual((sys.getrefcount(a), sys.getrefcount(out)), before)

    def test_failed_calls_too(self):
        f = rg.Func()
        f[x] = 0
        a = np.zeros(10, np.float32)
        before = sys.getrefcount(a)
        for _ in range(20):
            with self.assertRaises(rg.Error):
                f.realize(a)
        self.assertLessEqual(sys.getrefcount(a), before + 1)

    def test_memory_does_not_grow(self):
        f = rg.Func()
        f[x] = x
        view = np.zeros(1 << 18, np.int32)

        def work():
            for _ in range(200):
                f.realize([1 << 18])
                rg.Buffer(view).cropped(0, 0, 10)
                np.asarray(f.realize([1 << 10])).sum()

        work()
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(3):
            work()
        self.assertLess(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, 20000)


if __name__ == "__main__":
    unittest.main()
