"""Compiled functions as functions of Python modules: what `python_extension` writes, compiled and imported."""
import contextlib
import importlib.util
import io
import os
import subprocess
import sysconfig
import tempfile
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")
FOLDER = tempfile.TemporaryDirectory()
COMPILE = ["c++", "-std=c++17", "-Wall", "-Werror", "-fPIC", "-I", sysconfig.get_path("include"), "-idirafter",
           os.environ["RETROGRADE_HALIDE_RUNTIME_INCLUDE"]]
EXTENSION = sysconfig.get_config_var("EXT_SUFFIX")


def path(name):
    return os.path.join(FOLDER.name, name)


def built(module, sources, *flags):
    """The module, of C++ and objects in the folder."""
    subprocess.run([*COMPILE, "-shared", *flags, *map(path, sources), "-o", path(module + EXTENSION), "-lpthread",
                    "-ldl"], check=True)
    spec = importlib.util.spec_from_file_location(module, path(module + EXTENSION))
    result = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(result)
    return result


def write(f, arguments, name, *features, runtime=True):
    target = rg.get_host_target()
    for feature in features + (() if runtime else (rg.Target.Feature.NoRuntime,)):
        target = target.with_feature(feature)
    f.compile_to({rg.OutputFileType.object: path(name + ".o"),
                  rg.OutputFileType.python_extension: path(name + ".py.cpp")}, arguments, name, target)
    return [name + ".py.cpp", name + ".o"]


class Functions(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        image, gain = rg.ImageParam("uint8", 2, "image"), rg.Param("float32", "gain")
        offset, doubled = rg.Param("int8", "offset"), rg.Param("bool", "doubled")
        image.dim(0).set_stride(None)
        f = rg.Func("f")
        value = image[x, y] * gain + offset + 100 * x
        f[x, y] = rg.select(doubled, 2 * value, value)
        cls.module = built("brighten", write(f, [image, gain, offset, doubled], "brighten"))
        cls.image = np.arange(6, dtype=np.uint8).reshape(2, 3)
        cls.wanted = cls.image * 2.5 - 1 + 100 * np.arange(3)

    def test_take_arrays_and_numbers_in_order_or_by_name(self):
        out = np.zeros((2, 3), np.float32)
        self.assertIsNone(self.module.brighten(self.image, 2.5, -1, False, out))
        np.testing.assert_array_equal(out, self.wanted)
        self.module.brighten(offset=np.int64(-1), f=out, doubled=np.True_, gain=np.float32(2.5), image=self.image)
        np.testing.assert_array_equal(out, 2 * self.wanted)

    def test_arrays_of_any_strides(self):
        out, wide = np.zeros((2, 3), np.float32), np.zeros((4, 6), np.uint8)
        wide[1::2, ::2] = self.image
        self.module.brighten(wide[1::2, ::2], 2.5, -1, False, out)
        np.testing.assert_array_equal(out, self.wanted)

    def test_arrays_in_the_order_of_fortran_are_not_reversed(self):
        out = np.zeros((3, 2), np.float32, order="F")
        self.module.brighten(np.asfortranarray(self.image.T), 2.5, -1, False, out)
        np.testing.assert_array_equal(out.T, self.wanted)

    def test_one_row_is_one_row_in_either_order(self):
        out = np.zeros((1, 3), np.float32, order="F")
        self.module.brighten(self.image[:1], 2.5, -1, False, out)
        np.testing.assert_array_equal(out, self.wanted[:1])

    def test_buffers_keep_where_they_begin(self):
        out = rg.Buffer(np.zeros((2, 2), np.float32))
        out.set_min([1, 0])
        self.module.brighten(self.image, 2.5, -1, False, out)
        np.testing.assert_array_equal(np.asarray(out), self.wanted[:, 1:])

    def test_errors_are_those_of_the_function_or_of_python(self):
        out = np.zeros((2, 3), np.float32)
        with self.assertRaises(RuntimeError) as raised:
            self.module.brighten(self.image.astype(np.float32), 2.5, -1, False, out)
        self.assertEqual(str(raised.exception), "Halide Runtime Error: -3")
        self.assertIn("image", raised.exception.text)
        with self.assertRaisesRegex(RuntimeError, "Halide Runtime Error"):
            self.module.brighten(self.image, 2.5, -1, False, np.zeros((2, 4), np.float32))
        with self.assertRaisesRegex(OverflowError, "offset has 8 bits, which 128 does not fit"):
            self.module.brighten(self.image, 2.5, 128, False, out)
        with self.assertRaises(TypeError):
            self.module.brighten(self.image, 2.5, 1.5, False, out)
        with self.assertRaises(TypeError):
            self.module.brighten(self.image, 2.5, -1, out)
        with self.assertRaisesRegex(TypeError, "image holds elements of format"):
            self.module.brighten(self.image.astype(complex), 2.5, -1, False, out)
        with self.assertRaisesRegex(ValueError, "no multiples"):
            odd = np.zeros((2, 3), [("a", np.uint8), ("b", np.float32)])["b"]
            self.module.brighten(self.image, 2.5, -1, False, odd)
        out.flags.writeable = False
        with self.assertRaises(ValueError):
            self.module.brighten(self.image, 2.5, -1, False, out)


class Modules(unittest.TestCase):
    def test_of_several_files(self):
        f, g, code = rg.Func("f"), rg.Func("g"), rg.Param("uint8", "code")
        f[x] = code
        g[x] = rg.print(code + x, "at", x)
        write(f, [code], "fill", rg.Target.Feature.UserContext)
        write(g, [code], "count", runtime=False)
        rg.compile_standalone_runtime({rg.OutputFileType.python_extension: path("both.py.cpp")},
                                      rg.get_host_target())
        for name in ("fill", "count"):
            subprocess.run([*COMPILE, "-DHALIDE_PYTHON_EXTENSION_OMIT_MODULE_DEFINITION", "-c", path(name + ".py.cpp"),
                            "-o", path(name + ".py.o")], check=True)
        module = built("both", ["both.py.cpp", "fill.py.o", "fill.o", "count.py.o", "count.o"],
                       "-DHALIDE_PYTHON_EXTENSION_FUNCTIONS=X(fill) X(count)")
        filled = bytearray(4)
        module.fill(None, ord("q"), filled)
        self.assertEqual(filled, b"qqqq")
        printed, out = io.StringIO(), np.zeros(2, np.int32)
        with contextlib.redirect_stdout(printed):
            module.count(3, out)
        self.assertEqual((list(out), printed.getvalue()), ([3, 4], "3 at 0\n4 at 1\n"))

    def test_of_truth_values(self):
        image, f = rg.ImageParam("bool", 1, "image"), rg.Func("f")
        f[x] = ~image[x]
        module = built("negate", write(f, [image], "negate"))
        out = np.zeros(2, bool)
        module.negate(np.array([True, False]), out)
        self.assertEqual(list(out), [False, True])

    def test_of_kernels(self):
        image, f, xo, xi = rg.ImageParam("float32", 1, "image"), rg.Func("f"), rg.Var("xo"), rg.Var("xi")
        f[x] = image[x] + 1
        f.gpu_tile(x, xo, xi, 16)
        # Kernels for the simulated device, whose library the module finds at run time.
        library = os.path.join(os.environ["RETROGRADE_BUILD_DIR"], "libretrograde_simt.so")
        os.environ.update(RETROGRADE_GPU="simulated", RETROGRADE_SIMT_LIBRARY=library)
        module = built("kernels", write(f, [image], "on_device", rg.Target.Feature.CUDA),
                       "-DHALIDE_PYTHON_EXTENSION_MODULE_NAME=kernels")
        image, out = np.arange(40, dtype=np.float32), np.zeros(40, np.float32)
        for array in (image, image[::-1].copy()):
            module.on_device(array, out)
            np.testing.assert_array_equal(out, array + 1)
        part = rg.Buffer(np.zeros(20, np.float32))
        part.set_min([7])
        module.on_device(rg.Buffer(image), part)
        np.testing.assert_array_equal(np.asarray(part), image[7:27] + 1)

    def test_scalars_that_python_has_not(self):
        f, half = rg.Func("f"), rg.Param("float16", "half")
        f[x] = half
        with self.assertRaisesRegex(rg.Unsupported, "Python supports the scalars' types"):
            write(f, [half], "f")


if __name__ == "__main__":
    unittest.main()
