"""Pictures as arrays of planes, from files and to them."""
import os
import tempfile
import unittest

import numpy as np
import retrograde as rg
import retrograde.imageio as pictures

try:
    import PIL
except ImportError:
    PIL = None

COLOURS = np.arange(3 * 4 * 5, dtype=np.uint8).reshape(3, 4, 5)


class Layouts(unittest.TestCase):
    def test_are_changed_by_copies(self):
        beside = pictures.copy_to_interleaved(COLOURS)
        self.assertTrue(pictures.is_interleaved(beside))
        self.assertFalse(pictures.is_interleaved(COLOURS))
        self.assertFalse(pictures.is_interleaved(pictures.copy_to_planar(beside)))
        for picture in (beside, pictures.copy_to_planar(beside)):
            np.testing.assert_array_equal(picture, COLOURS)
        self.assertEqual(rg.Buffer(beside).dim(2).stride(), 1)
        grey = np.eye(3, dtype=np.uint8)
        np.testing.assert_array_equal(pictures.copy_to_interleaved(grey), grey)


@unittest.skipUnless(PIL, "no Pillow")
class Files(unittest.TestCase):
    def test_hold_what_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            for picture in (COLOURS, COLOURS[0], COLOURS[:, ::-1]):
                pictures.imwrite(path, picture)
                read = pictures.imread(path)
                np.testing.assert_array_equal(read, picture)
                self.assertTrue(read.flags.c_contiguous)
            pictures.imwrite(path, COLOURS)
            image = rg.Buffer(pictures.imread(path))
            self.assertEqual(image[1, 2, 0], COLOURS[0, 2, 1])
            with self.assertRaises(ValueError):
                pictures.imwrite(path, np.zeros(3, np.uint8))


if __name__ == "__main__":
    unittest.main()
