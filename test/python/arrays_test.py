"""Arrays of NumPy as Buffers and Buffers as arrays: no copies, any strides, read-only ones, every type."""
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")
TYPES = ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float16", "float32",
         "float64"]


class OneAxisRule(unittest.TestCase):
    def test_a_y_x_is_f_x_y_in_every_direction(self):
        a = np.arange(24).reshape(2, 3, 4)
        b = rg.Buffer(a)
        back = np.asarray(b)
        self.assertEqual([b.extent(d) for d in range(3)], [4, 3, 2])
        self.assertEqual((b.shape, back.shape), (a.shape, a.shape))
        for at in np.ndindex(a.shape):
            self.assertEqual(b[at[::-1]], a[at])
            self.assertEqual(back[at], a[at])

    def test_strided_views_of_all_kinds(self):
        base = np.arange(120, dtype=np.int32).reshape(4, 5, 6)
        views = [base.T, base[:, ::2], base[..., 1::3], base[::-1], base[:, ::-1, ::-2], base[1], base[:, 2, :],
                 np.broadcast_to(base[0], (3, 5, 6)), base[:0], base[2, 3, 4, ...], np.asfortranarray(base)]
        for view in views:
            b = rg.Buffer(view)
            np.testing.assert_array_equal(np.asarray(b), view)
            self.assertTrue(np.shares_memory(np.asarray(b), view) or view.size == 0)


class NoCopies(unittest.TestCase):
    def test_from_and_to_numpy(self):
        a = np.zeros((3, 4), np.float32)
        b = rg.Buffer(a)
        b[1, 2] = 7
        self.assertEqual(a[2, 1], 7)
        view = np.asarray(b)
        view[0, 0] = 5
        self.assertEqual((a[0, 0], b[0, 0]), (5, 5))
        self.assertEqual(view.__array_interface__["data"], a.__array_interface__["data"])

    def test_results_of_realize(self):
        f = rg.Func()
        f[x] = x
        b = f.realize([4])
        a = np.asarray(b)
        a[2] = 40
        self.assertEqual(b[2], 40)

    def test_outputs_are_written_in_place(self):
        f = rg.Func()
        f[x, y] = x + 10 * y
        a = np.full((6, 8), -1, np.int32)
        f.realize(a[1:4, 2:6])
        np.testing.assert_array_equal(a[1:4, 2:6], [[0, 1, 2, 3], [10, 11, 12, 13], [20, 21, 22, 23]])
        a[1:4, 2:6] = -1
        self.assertTrue((a == -1).all(), "and nothing beside it")

    def test_the_array_interface(self):
        b = rg.Buffer("uint16", [4, 3])
        b.fill(9)
        facts = b.__array_interface__
        self.assertEqual((facts["typestr"], facts["shape"], facts["strides"]), ("<u2", (3, 4), (8, 2)))

        class Foreign:
            def __init__(self, array):
                self.array, self.__array_interface__ = array, array.__array_interface__

        a = np.arange(6, dtype=np.int16).reshape(2, 3)
        np.testing.assert_array_equal(np.asarray(rg.Buffer(Foreign(a))), a)
        np.testing.assert_array_equal(np.asarray(rg.Buffer(Foreign(a[:, ::-1]))), a[:, ::-1])

    def test_other_objects_of_the_buffer_protocol(self):
        import array
        self.assertEqual(rg.Buffer(array.array("d", [1, 2, 3]))[1], 2.0)
        self.assertEqual(rg.Buffer(bytearray(b"abc"))[2], ord("c"))
        self.assertEqual(bytes(memoryview(rg.Buffer(np.arange(3, dtype=np.uint8)))), b"\0\1\2")


class AnyStrides(unittest.TestCase):
    def test_inputs(self):
        image = rg.ImageParam("int32", 2)
        f = rg.Func()
        f[x, y] = image[x, y] * 2
        base = np.arange(48, dtype=np.int32).reshape(6, 8)
        for a in (base, base.T, base[:, ::2], base[:, ::-1], base[::-1, ::3], base):
            image.set(a)
            np.testing.assert_array_equal(f.realize([a.shape[1], a.shape[0]]), 2 * a)
            np.testing.assert_array_equal(f.realize([a.shape[1], a.shape[0]], param_map={image: a}), 2 * a)

    def test_arrays_inside_of_programs(self):
        base = np.arange(48, dtype=np.float32).reshape(6, 8)
        for a in (base, base.T, base[:, ::2], base[:, ::-1]):
            b, f = rg.Buffer(a), rg.Func()
            f[x, y] = b[x, y] + 1
            f.vectorize(x, 4, rg.TailStrategy.GuardWithIf)
            np.testing.assert_array_equal(f.realize([a.shape[1], a.shape[0]]), a + 1)

    def test_outputs(self):
        f = rg.Func()
        f[x, y] = x + 10 * y
        want = np.asarray(f.realize([4, 3])).copy()
        base = np.zeros((20, 20), np.int32)
        for a in (base[:6:2, :12:3], base[:4, :3].T, base[2::-1, 3::-1], base[:3, :4]):
            a[...] = -1
            f.realize(a)
            np.testing.assert_array_equal(a, want)

    def test_a_promise_of_the_program_is_kept(self):
        image = rg.ImageParam("uint8", 3)
        image.dim(0).set_stride(3)
        f = rg.Func()
        f[x, y] = image[x, y, 0]
        image.set(np.zeros((3, 4, 5), np.uint8))
        with self.assertRaisesRegex(rg.RuntimeError, "stride"):
            f.realize([5, 4])
        image.set(np.ones((4, 5, 3), np.uint8).transpose(2, 0, 1))
        self.assertEqual(f.realize([5, 4])[4, 3], 1)


class StridesOfOneElement(unittest.TestCase):
    """An axis of one element or none leads nowhere: its stride may be anything, as libraries leave it."""

    def test_in_inputs_outputs_and_programs(self):
        as_strided = np.lib.stride_tricks.as_strided
        for stride in (0, 12, -20, 2**34):  # bytes
            # NumPy puts strides right where an array is dense without these axes, so some are not.
            for shape, strides in (((1,), (stride,)), ((0,), (stride,)), ((1, 1), (stride, stride)), ((0, 1), (4, stride)),
                                   ((3, 1), (8, stride)), ((1, 3), (stride, 8)), ((2, 1, 2), (16, stride, 4))):
                with self.subTest(shape=shape, strides=strides):
                    base = np.arange(8, dtype=np.int32)
                    given, out = as_strided(base, shape, strides), as_strided(np.zeros(8, np.int32), shape, strides)
                    at = tuple(rg.Var(f"d{d}") for d in range(len(shape)))
                    image, f, g = rg.ImageParam("int32", len(shape)), rg.Func(), rg.Func()
                    f[at] = image[at] * 2
                    g[at] = rg.Buffer(given)[at] * 2
                    image.set(given)
                    want = 2 * given.copy()
                    for func in (f, g):
                        np.testing.assert_array_equal(func.realize(list(reversed(shape))), want)
                    func.realize(out)
                    np.testing.assert_array_equal(out, want)
                    f.compile_to_callable([image])(given, out)
                    np.testing.assert_array_equal(out, want)


class ReadOnly(unittest.TestCase):
    def setUp(self):
        self.a = np.arange(6, dtype=np.float32)
        self.a.setflags(write=False)

    def test_they_can_be_read(self):
        b, f = rg.Buffer(self.a), rg.Func()
        f[x] = b[x] * 2
        np.testing.assert_array_equal(f.realize([6]), self.a * 2)
        self.assertTrue(b.is_read_only())
        self.assertFalse(np.asarray(b).flags.writeable)

    def test_they_are_never_written(self):
        b, f = rg.Buffer(self.a), rg.Func()
        f[x] = 1.0
        attempts = [lambda: f.realize(self.a), lambda: f.realize(b.cropped(0, 1, 2)), lambda: b.fill(0),
                    lambda: b.__setitem__(0, 1.0), lambda: b.copy_from(b.copy()), lambda: f.realize([b.alias()])]
        for attempt in attempts:
            with self.assertRaisesRegex(rg.CompileError, "read-only array is read only.*copy"):
                attempt()
        with self.assertRaises(TypeError):
            memoryview(b)[0] = 1.0
        np.testing.assert_array_equal(self.a, np.arange(6))

    def test_a_copy_can(self):
        b = rg.Buffer(self.a).copy()
        b[0] = 9
        self.assertEqual((b[0], self.a[0]), (9, 0))


class Types(unittest.TestCase):
    def test_every_type_goes_in_and_out(self):
        for name in TYPES:
            a = np.array([0, 1, 1], name) if name == "bool" else np.array([0, 1, 100], name)
            b = rg.Buffer(a)
            self.assertEqual(str(b.type()), name)
            self.assertEqual(b.type().dtype, np.dtype(name))
            f = rg.Func()
            f[x] = b[x]
            result = np.asarray(f.realize([3]))
            self.assertEqual(result.dtype, np.dtype(name))
            np.testing.assert_array_equal(result, a)
            self.assertEqual([b[i] for i in range(3)], a.tolist())

    def test_names_of_numpy_are_types(self):
        for name in TYPES:
            for spelling in (name, np.dtype(name), np.dtype(name).type):
                self.assertEqual(str(rg.Buffer(spelling, [2]).type()), name)

    def test_extremes_survive(self):
        for name in TYPES[1:9]:
            info = np.iinfo(name)
            b = rg.Buffer(np.array([info.min, info.max], name))
            self.assertEqual((b[0], b[1]), (info.min, info.max))
            b[0] = info.max
            self.assertEqual(b[0], info.max)
            with self.assertRaises(OverflowError):
                b[0] = info.max + 1

    def test_bfloat16_by_its_bits(self):
        bits = np.array([0x3F80, 0x4000, 0xC040, 0x7F80, 0x7FC0], np.uint16)
        b = rg.Buffer(bits, type=rg.BFloat(16))
        self.assertEqual([b[i] for i in range(4)], [1.0, 2.0, -3.0, float("inf")])
        f = rg.Func()
        f[x] = rg.bf16(rg.f32(b[x]) * 2)
        result = f.realize([4])
        self.assertEqual([result[i] for i in range(4)], [2.0, 4.0, -6.0, float("inf")])
        np.testing.assert_array_equal(np.asarray(result.bits()), [0x4000, 0x4080, 0xC0C0, 0x7F80])
        with self.assertRaisesRegex(BufferError, "bits"):
            memoryview(result)

    def test_what_is_no_number_is_refused(self):
        for a in (np.zeros(3, "complex64"), np.zeros(3, ">f4"), np.zeros(3, "datetime64[s]"), np.array(["a"]),
                  np.array([None])):
            with self.assertRaisesRegex(rg.CompileError, "numbers in the order of bytes of this machine"):
                rg.Buffer(a)
        odd = np.zeros(3, [("a", "u1"), ("b", "f4")])["b"]
        with self.assertRaisesRegex(rg.CompileError, "whole elements.*copy"):
            rg.Buffer(odd)


if __name__ == "__main__":
    unittest.main()
