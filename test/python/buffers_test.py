"""Buffers: shapes, elements, copies."""
import unittest

import numpy as np
import retrograde as rg


class Making(unittest.TestCase):
    def test_sizes_are_in_the_order_of_coordinates(self):
        b = rg.Buffer(rg.UInt(8), [5, 4, 3], "image")
        self.assertEqual((b.width(), b.height(), b.channels(), b.dimensions()), (5, 4, 3, 3))
        self.assertEqual((b.shape, b.name(), b.type()), ((3, 4, 5), "image", rg.UInt(8)))
        self.assertEqual((b.number_of_elements(), b.size_in_bytes()), (60, 60))
        self.assertEqual([b.stride(d) for d in range(3)], [1, 5, 20])
        self.assertEqual(repr(b), '<retrograde.Buffer "image" uint8 over [0, 5) x [0, 4) x [0, 3)>')

    def test_layouts(self):
        self.assertEqual([rg.Buffer.make_interleaved("uint8", 5, 4, 3).stride(d) for d in range(3)], [3, 15, 1])
        self.assertEqual([rg.Buffer("int32", [2, 3], [1, 0]).stride(d) for d in range(2)], [3, 1])
        b = rg.Buffer.make_scalar("float64")
        b[()] = 2.5
        self.assertEqual((b[()], np.asarray(b).shape), (2.5, ()))
        self.assertEqual(rg.Buffer.make_with_shape_of(rg.Buffer("int8", [2, 3])).shape, (3, 2))
        self.assertFalse(rg.Buffer().defined())

    def test_axes_in_their_own_order(self):
        a = np.arange(6, dtype="int32").reshape(2, 3)
        kept = rg.Buffer(a, "kept", False)
        self.assertEqual((kept.name(), [kept.extent(d) for d in range(2)]), ("kept", [2, 3]))
        self.assertEqual(kept[1, 2], a[1, 2])
        a[1, 2] = 77
        self.assertEqual((kept[1, 2], rg.Buffer(a, reverse_axes=False)[1, 2]), (77, 77))
        turned = kept.reverse_axes()
        self.assertEqual(turned[2, 1], 77)
        self.assertEqual((np.asarray(turned).shape, np.asarray(kept).shape), ((2, 3), (3, 2)))

    def test_a_shape_that_asks_for_bounds(self):
        x, image, f = rg.Var("x"), rg.ImageParam("uint8", 1, "asked_for"), rg.Func("f")
        f[x] = image[x] + image[x + 2]
        call = f.compile_to_callable([image])
        wanted, made = rg.Buffer.make_bounds_query("uint8", [1]), rg.Buffer.make_bounds_query("uint8", [20])
        call(wanted, made)
        self.assertEqual((wanted.min(0), wanted.extent(0)), (0, 22))

    def test_impossible_sizes_are_errors(self):
        for sizes in ([-1], [2**31 - 1, 2**31 - 1]):
            with self.assertRaises(rg.CompileError):
                rg.Buffer("int32", sizes)
        with self.assertRaises(TypeError):
            rg.Buffer(object())


class Elements(unittest.TestCase):
    def test_outside_is_an_error(self):
        b = rg.Buffer("int32", [3, 2])
        for at in ((3, 0), (0, 2), (-1, 0), (4, 0)):
            with self.assertRaises((rg.CompileError, IndexError)):
                b[at]
            with self.assertRaises((rg.CompileError, IndexError)):
                b[at] = 1
        with self.assertRaisesRegex(rg.CompileError, "one coordinate for each dimension"):
            b[0]

    def test_values_that_do_not_fit_are_errors(self):
        b = rg.Buffer("uint8", [2])
        for value, error in ((256, OverflowError), (-1, OverflowError), (0.5, TypeError), ("a", TypeError)):
            with self.assertRaises(error):
                b[0] = value
        b[0] = 3.0
        self.assertEqual(b[0], 3)

    def test_with_variables_it_is_an_expression(self):
        b = rg.Buffer(np.arange(5, dtype=np.int16))
        x = rg.Var("x")
        self.assertEqual(b[x].type(), rg.Int(16))
        self.assertEqual(b(x + 1).type(), rg.Int(16))
        self.assertEqual(b(2), 2)

    def test_fill_compare_copy(self):
        b = rg.Buffer("float16", [3, 3])
        self.assertTrue(b.fill(0.5).all_equal(0.5))
        other = b.copy()
        other[1, 1] = 2
        self.assertFalse(other.all_equal(0.5))
        self.assertTrue(b.all_equal(0.5))
        b.copy_from(other)
        self.assertEqual(b[1, 1], 2)
        self.assertEqual(rg.Buffer.make_interleaved("uint8", 5, 4, 3).fill(1).copy_to_planar().stride(1), 5)
        self.assertEqual(rg.Buffer("uint8", [5, 4, 3]).fill(1).copy_to_interleaved().stride(0), 3)
        seen = []
        b.for_each_element(lambda x, y: seen.append((x, y)))
        self.assertEqual(len(set(seen)), 9)


class Shapes(unittest.TestCase):
    def setUp(self):
        self.b = rg.Buffer(np.arange(24, dtype=np.int32).reshape(4, 6))

    def test_new_handles_to_the_same_memory(self):
        b = self.b
        window = b.cropped([(2, 3), (1, 2)])
        self.assertEqual((window.left(), window.right(), window.top(), window.bottom()), (2, 4, 1, 2))
        self.assertEqual(window[2, 1], b[2, 1])
        np.testing.assert_array_equal(np.asarray(window), np.asarray(b)[1:3, 2:5])
        np.testing.assert_array_equal(np.asarray(b.cropped(0, 1, 2)), np.asarray(b)[:, 1:3])
        np.testing.assert_array_equal(np.asarray(b.sliced(1, 2)), np.asarray(b)[2])
        np.testing.assert_array_equal(np.asarray(b.sliced(0)), np.asarray(b)[:, 0])
        np.testing.assert_array_equal(np.asarray(b.transposed(0, 1)), np.asarray(b).T)
        self.assertEqual(b.embedded(2, 5).min(2), 5)
        self.assertEqual(b.translated([10, 20])[12, 21], b[2, 1])
        self.assertEqual(b.translated(0, 3)[3, 0], b[0, 0])
        window[2, 1] = -1
        self.assertEqual(b[2, 1], -1)

    def test_changes_for_all_handles(self):
        b, same = self.b, rg.Buffer(self.b)
        b.set_min([1, 2])
        self.assertEqual((same.min(0), same.dim(1).min(), same.dim(1).max()), (1, 2, 5))
        b.crop(0, 2, 3)
        b.slice(1, 3)
        b.translate(0, -2)
        b.add_dimension()
        b.transpose(0, 1)
        b.embed(0, 7)
        self.assertEqual([same.extent(d) for d in range(3)], [1, 1, 3])
        self.assertTrue(same.contains([7, 0, 2]))
        self.assertFalse(same.contains([7, 0, 3]))
        self.assertTrue(same.same_as(b))

    def test_a_view_keeps_its_memory(self):
        b = rg.Buffer("int32", [1000])
        b.fill(7)
        view = np.asarray(b)
        b.deallocate()
        del b
        self.assertTrue((view == 7).all())

    def test_a_shape_without_memory_is_no_array(self):
        b = rg.Buffer("int32", [4])
        b.deallocate()
        with self.assertRaisesRegex(BufferError, "must have memory"):
            memoryview(b)
        b.allocate()
        self.assertEqual(memoryview(b).shape, (4,))

    def test_devices_are_there_or_said_not_to_be(self):
        self.assertFalse(self.b.has_device_allocation())
        self.assertFalse(hasattr(self.b, "__cuda_array_interface__"))
        self.b.set_host_dirty()
        try:
            self.b.copy_to_device()
        except rg.Error as error:
            self.assertRegex(str(error), "cuda")
            self.assertFalse(self.b.has_device_allocation())
        else:
            self.assertTrue(self.b.has_device_allocation())


if __name__ == "__main__":
    unittest.main()
