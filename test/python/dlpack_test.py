"""DLPack, both protocols, both directions."""
import ctypes
import gc
import sys
import unittest

import numpy as np
import retrograde as rg


class OldOnly:
    """A library that knows the first protocol."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return (1, 0)


class NewOnly:
    """One that gives what a Buffer gives to those who ask for version 1."""

    def __init__(self, buffer):
        self.buffer = buffer

    def __dlpack__(self, *, stream=None, max_version=None, dl_device=None, copy=None):
        assert max_version == (1, 0)
        return self.buffer.__dlpack__(max_version=max_version)


class Given(unittest.TestCase):
    def test_numpy_takes_it_without_a_copy(self):
        b = rg.Buffer("float32", [4, 3])
        b.fill(2)
        a = np.from_dlpack(b)
        self.assertEqual(a.shape, (3, 4))
        b[1, 2] = 7
        self.assertEqual(a[2, 1], 7)
        self.assertEqual(b.__dlpack_device__(), (1, 0))

    def test_all_types(self):
        for name in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float16", "float32",
                     "float64"):
            a = np.arange(5).astype(name)
            np.testing.assert_array_equal(np.from_dlpack(rg.Buffer(a)), a)

    def test_it_outlives_the_buffer(self):
        a = np.arange(1000, dtype=np.float64)
        got = np.from_dlpack(rg.Buffer(a.copy()))
        gc.collect()
        np.testing.assert_array_equal(got, a)

    def test_a_capsule_that_nobody_takes_lets_go(self):
        a = np.zeros(8)
        before = sys.getrefcount(a)
        for versioned in (None, (1, 0)):
            for _ in range(10):
                rg.Buffer(a).__dlpack__(max_version=versioned)
        self.assertEqual(sys.getrefcount(a), before)

    def test_what_it_cannot_say_is_refused(self):
        with self.assertRaisesRegex(BufferError, "negative strides"):
            rg.Buffer(np.arange(4)[::-1]).__dlpack__()
        fixed = np.arange(4)
        fixed.setflags(write=False)
        with self.assertRaisesRegex(BufferError, "read only"):
            rg.Buffer(fixed).__dlpack__()
        rg.Buffer(fixed).__dlpack__(max_version=(1, 0))
        with self.assertRaises(BufferError):
            rg.Buffer(fixed).__dlpack__(stream=1, max_version=(1, 0))
        with self.assertRaises(BufferError):
            rg.Buffer(fixed).__dlpack__(dl_device=(2, 0), max_version=(1, 0))

    def test_a_copy_on_request(self):
        a = np.arange(4)
        other = rg.Buffer(NewOnly(rg.Buffer(a)))
        other[0] = 9
        self.assertEqual(a[0], 9)

        class Copied(NewOnly):
            def __dlpack__(self, **more):
                return self.buffer.__dlpack__(max_version=(1, 0), copy=True)

        rg.Buffer(Copied(rg.Buffer(a)))[0] = 5
        self.assertEqual(a[0], 9)


class Taken(unittest.TestCase):
    def test_of_either_protocol(self):
        a = np.arange(12, dtype=np.int32).reshape(3, 4)
        for foreign in (OldOnly(a), OldOnly(a.T), NewOnly(rg.Buffer(a)), NewOnly(rg.Buffer(a[:, ::2]))):
            b = rg.Buffer(foreign)
            np.testing.assert_array_equal(np.asarray(b), np.asarray(getattr(foreign, "array", None)
                                                                    if hasattr(foreign, "array")
                                                                    else foreign.buffer))
        b = rg.Buffer(OldOnly(a))
        b[0, 0] = 50
        self.assertEqual(a[0, 0], 50)

    def test_read_only_is_kept(self):
        a = np.arange(4)
        a.setflags(write=False)
        b = rg.Buffer(NewOnly(rg.Buffer(a)))
        self.assertTrue(b.is_read_only())

    def test_bfloat16(self):
        b = rg.Buffer(np.array([0x3F80, 0x4000], np.uint16), type=rg.BFloat(16))
        again = rg.Buffer(NewOnly(b))
        self.assertEqual((again.type(), again[1]), (rg.BFloat(16), 2.0))

    def test_its_memory_lives_as_long_as_the_buffer(self):
        a = np.arange(1000)
        before = sys.getrefcount(a)
        b = rg.Buffer(OldOnly(a))
        self.assertGreater(sys.getrefcount(a), before)
        crop = b.cropped(0, 10, 5)
        del b
        gc.collect()
        self.assertGreater(sys.getrefcount(a), before)
        self.assertEqual(crop[10], 10)
        del crop
        gc.collect()
        self.assertEqual(sys.getrefcount(a), before)

    def test_used_capsules_are_renamed(self):
        capsule = np.arange(3).__dlpack__()

        class Holder:
            def __dlpack__(self):
                return capsule

        rg.Buffer(Holder())
        name = ctypes.pythonapi.PyCapsule_GetName
        name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
        self.assertEqual(name(capsule), b"used_dltensor")
        with self.assertRaises(BufferError):
            rg.Buffer(Holder())


if __name__ == "__main__":
    unittest.main()
