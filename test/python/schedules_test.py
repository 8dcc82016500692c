"""Schedules: every directive, with results as without."""
import unittest

import numpy as np
import retrograde as rg

x, y, c, xo, yo, xi, yi, u, v = (rg.Var(n) for n in "x y c xo yo xi yi u v".split())


def blur():
    """Two stages whose results do not depend on how they are computed."""
    g, f = rg.Func("g"), rg.Func("f")
    g[x, y] = x * x + 3 * y
    f[x, y] = g[x, y] + g[x + 1, y] + g[x, y + 1]
    return g, f


WANT = np.asarray(blur()[1].realize([37, 21])).copy()


class Directives(unittest.TestCase):
    def check(self, schedule, *words):
        g, f = blur()
        schedule(g, f)
        nest = f.loop_nest()
        for word in words:
            self.assertIn(word, nest)
        np.testing.assert_array_equal(f.realize([37, 21]), WANT)

    def test_places(self):
        self.check(lambda g, f: g.compute_root(), "produce g")
        self.check(lambda g, f: g.compute_at(f, y), "produce g")
        self.check(lambda g, f: g.compute_at(rg.LoopLevel(f, y)), "produce g")
        self.check(lambda g, f: g.store_root().compute_at(f, y), "store g")
        self.check(lambda g, f: g.store_at(f, y).compute_at(f, x), "produce g")
        self.check(lambda g, f: g.compute_at(f, x).hoist_storage(f, y))
        self.check(lambda g, f: g.compute_at(f, x).hoist_storage_root())
        self.check(lambda g, f: g.compute_inline())
        self.check(lambda g, f: g.compute_root().store_in(rg.MemoryType.Heap))
        self.check(lambda g, f: g.compute_root().async_())

    def test_loops(self):
        self.check(lambda g, f: f.split(x, xo, xi, 8, rg.TailStrategy.GuardWithIf), "xo", "xi")
        self.check(lambda g, f: f.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi).parallel(yo), "parallel", "vectorized")
        self.check(lambda g, f: f.tile(x, y, xi, yi, 8, 4).unroll(xi, 2), "unrolled")
        self.check(lambda g, f: f.tile([x, y], [xo, yo], [xi, yi], [4, 4]))
        self.check(lambda g, f: f.tile([x, y], [xi, yi], [4, 4]))
        self.check(lambda g, f: f.reorder(y, x).serial(x))
        self.check(lambda g, f: f.reorder([y, x]))
        self.check(lambda g, f: f.fuse(x, y, u).parallel(u, 16), "u")
        self.check(lambda g, f: f.rename(x, u).vectorize(u, 8), "u")
        self.check(lambda g, f: f.partition(x, rg.Partition.Never).never_partition(x, y).always_partition([x]))
        self.check(lambda g, f: f.never_partition_all().always_partition_all())

    def test_sizes_and_layouts(self):
        self.check(lambda g, f: f.bound(x, 0, 37).bound_extent(y, 21))
        self.check(lambda g, f: g.compute_root().align_bounds(x, 8).align_extent(y, 4))
        self.check(lambda g, f: g.compute_root().reorder_storage(y, x).align_storage(y, 8))
        self.check(lambda g, f: g.store_root().compute_at(f, y).fold_storage(y, 2))
        self.check(lambda g, f: g.compute_root().bound_storage(x, 64))
        self.check(lambda g, f: f.set_estimate(x, 0, 37).set_estimates([(0, 37), (0, 21)]))

    def test_specialize(self):
        n = rg.Param("int32", "n", 1)
        g, f = blur()
        f.specialize(n > 3).vectorize(x, 8)
        f.specialize_fail("n is small")
        with self.assertRaisesRegex(rg.RuntimeError, "n is small"):
            f.realize([37, 21])
        n.set(4)
        np.testing.assert_array_equal(f.realize([37, 21]), WANT)

    def test_compute_with(self):
        a, b, f = rg.Func("a"), rg.Func("b"), rg.Func("f")
        a[x, y] = x
        b[x, y] = y
        f[x, y] = a[x, y] + b[x, y]
        a.compute_root()
        b.compute_root().compute_with(a, y)
        np.testing.assert_array_equal(f.realize([4, 3]), [[i + j for i in range(4)] for j in range(3)])
        b.compute_with(a, x, rg.LoopAlignStrategy.AlignStart)
        b.compute_with(rg.LoopLevel(a, y), [(y, rg.LoopAlignStrategy.NoAlign)])

    def test_loops_on_gpus(self):
        def loops(schedule):
            g, f = blur()
            schedule(f)
            return rg.Pipeline(f).schedule_log().to_text().splitlines()

        xi, yi = rg.Var("xi"), rg.Var("yi")
        for schedule, threads in (
            (lambda f: f.gpu_tile(x, y, xi, yi, 8, 4, rg.TailStrategy.GuardWithIf), 2),
            (lambda f: f.gpu_tile(x, xi, 8), 1),
            (lambda f: f.gpu(y, x), 1),
            (lambda f: f.gpu_blocks(y).gpu_lanes(x), 0),
            (lambda f: f.gpu_single_thread(), 0),
        ):
            text = "\n".join(loops(schedule))
            self.assertIn("GpuBlock", text)
            self.assertEqual(text.count("GpuThread"), threads, text)
        g, f = blur()
        f.gpu_tile(x, y, xi, yi, 8, 4)
        with self.assertRaisesRegex(rg.CompileError, "the target has a GPU"):
            f.realize([16, 16])

    def test_memoize_and_prefetch(self):
        g, f = blur()
        g.compute_root().memoize(rg.EvictionKey(rg.Expr(3)))
        f.prefetch(g, y, y, 2)
        np.testing.assert_array_equal(f.realize([37, 21]), WANT)

    def test_wrappers_and_clones(self):
        self.check(lambda g, f: g.in_(f).compute_root(), "g_in_f")
        self.check(lambda g, f: g.in_().compute_root())
        self.check(lambda g, f: g.in_([f]).compute_root())
        self.check(lambda g, f: g.clone_in(f).compute_root(), "g_clone_in_f")

    def test_copies_of_inputs(self):
        image = rg.Buffer(np.arange(10, dtype=np.int32), "image")
        f = rg.Func("f")
        f[x] = image[3 * x]
        f.copy_input(image).compute_root()
        np.testing.assert_array_equal(f.realize([4]), [0, 3, 6, 9])


class Updates(unittest.TestCase):
    def histogram(self):
        data = rg.Buffer(np.arange(1000, dtype=np.int32) * 7 % 10)
        r, h = rg.RDom([(0, 1000)], "r"), rg.Func("h")
        h[x] = 0
        h[rg.clamp(data[r], 0, 9)] += 1
        return h, r

    def test_rfactor_and_atomic(self):
        want = np.full(10, 100)
        h, r = self.histogram()
        np.testing.assert_array_equal(h.realize([10]), want)
        ro, ri = rg.RVar("ro"), rg.RVar("ri")
        h.update().split(r.x, ro, ri, 100)
        partial = h.update().rfactor(ro, u)
        partial.compute_root().update().parallel(u)
        np.testing.assert_array_equal(h.realize([10]), want)
        self.assertRegex(partial.name(), "h_intm")
        h, r = self.histogram()
        h.update().atomic().parallel(r.x)
        np.testing.assert_array_equal(h.realize([10]), want)
        h, r = self.histogram()
        h.update().split(r, ro, ri, 100).rfactor([(ro, u)])

    def test_stages(self):
        h, r = self.histogram()
        self.assertEqual((h.update().name(), h.update().index(), h.stage(0).index()),
                         (h.name() + ".update(0)", 1, 0))
        self.assertEqual([v.name() for v in h.update().split_vars()], [r.x.name()])
        self.assertEqual(repr(h.update()), f"<retrograde.Stage {h.name()}.update(0)>")
        self.assertIn("r", h.update().dump_argument_list())
        h.update().allow_race_conditions()
        h.update().unscheduled()
        with self.assertRaisesRegex(rg.CompileError, "numbered from 0"):
            h.update(3)


class LoopLevels(unittest.TestCase):
    def test_set_later(self):
        g, f = blur()
        level = rg.LoopLevel()
        g.compute_at(level)
        self.assertFalse(level.defined())
        level.set(rg.LoopLevel(f, y))
        self.assertEqual((level.func(), level.var().name(), level.stage_index()), (f.name(), "y", -1))
        np.testing.assert_array_equal(f.realize([37, 21]), WANT)
        self.assertTrue(rg.LoopLevel.root().is_root() and rg.LoopLevel.inlined().is_inlined())
        self.assertEqual(rg.LoopLevel.root(), rg.LoopLevel.root())
        self.assertNotEqual(rg.LoopLevel.root(), level)
        with self.assertRaisesRegex(rg.CompileError, "locked"):
            level.lock().set(rg.LoopLevel.root())

    def test_directives_give_back_the_func_itself(self):
        g, f = blur()
        self.assertIs(g.compute_root().vectorize(x, 8).parallel(y), g)


if __name__ == "__main__":
    unittest.main()
