"""What a notebook shows."""
import struct
import unittest
import zlib

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


def decoded(png):
    """Width, height, colour type and pixels of a PNG without filters."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data, header = 8, b"", None
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + size]
        assert struct.unpack(">I", png[at + 8 + size:at + 12 + size])[0] == zlib.crc32(kind + body)
        header = struct.unpack(">IIBBBBB", body) if kind == b"IHDR" else header
        data += body if kind == b"IDAT" else b""
        at += 12 + size
    width, height, _, colour = header[:4]
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, -1)
    assert not rows[:, 0].any()
    return colour, rows[:, 1:].reshape(height, width, -1)


class Pictures(unittest.TestCase):
    def test_bytes_as_they_are(self):
        a = np.arange(12, dtype=np.uint8).reshape(3, 4)
        colour, pixels = decoded(rg.Buffer(a)._repr_png_())
        self.assertEqual(colour, 0)
        np.testing.assert_array_equal(pixels[..., 0], a)

    def test_colours(self):
        a = np.random.default_rng(1).random((3, 4, 5)).astype(np.float32)
        colour, pixels = decoded(rg.Buffer(a)._repr_png_())
        self.assertEqual((colour, pixels.shape), (2, (4, 5, 3)))
        np.testing.assert_array_equal(pixels[1, 2], (a[:, 1, 2] * 255 + 0.5).astype(np.uint8))

    def test_values_of_all_kinds(self):
        for a, want in ((np.array([[0, 1]], np.uint16) * 65535, [0, 255]), (np.array([[-5, 5]], np.int32), [0, 255]),
                        (np.array([[np.nan, np.inf]], np.float32), [0, 255]), (np.array([[False, True]]), [0, 255]),
                        (np.full((1, 2), 7.0), [0, 0])):
            np.testing.assert_array_equal(decoded(rg.Buffer(a)._repr_png_())[1].ravel(), want)

    def test_large_ones_are_thinned(self):
        png = rg.Buffer(np.zeros((10, 5000), np.uint8))._repr_png_()
        self.assertEqual(decoded(png)[1].shape, (2, 1000, 1))

    def test_what_is_none(self):
        for a in (np.zeros((2, 2, 2, 2)), np.zeros((7, 2, 2)), np.zeros((0, 3))):
            self.assertIsNone(rg.Buffer(a)._repr_png_())
        self.assertIsNone(rg.Buffer()._repr_png_())
        self.assertIsNone(rg.Buffer(rg.BFloat(16), [2, 2])._repr_png_())


class Loops(unittest.TestCase):
    def test_of_a_func(self):
        f = rg.Func("f")
        f[x, y] = x
        f.vectorize(x, 4)
        self.assertIn("vectorized", f._repr_html_())
        self.assertTrue(f._repr_html_().startswith("<pre>"))
        self.assertIn("undefined&gt;", rg.Func("g")._repr_html_())


if __name__ == "__main__":
    unittest.main()
