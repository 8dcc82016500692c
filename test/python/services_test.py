"""Modules, Callables, C functions, handlers, warnings, passes, the cache on disk."""
import ctypes
import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
import retrograde as rg
from retrograde import runtime

x, y = rg.Var("x"), rg.Var("y")


class Callables(unittest.TestCase):
    def setUp(self):
        self.image, self.gain = rg.ImageParam("float32", 2, "image"), rg.Param("float32", "gain")
        self.f = rg.Func("f")
        self.f[x, y] = self.image[x, y] * self.gain

    def test_take_their_arguments_and_then_outputs(self):
        call = self.f.compile_to_callable([self.image, self.gain])
        a, out = np.arange(6, dtype=np.float32).reshape(2, 3), np.zeros((2, 3), np.float32)
        call(a, 2, out)
        np.testing.assert_array_equal(out, 2 * a)
        call(a, np.float32(3), rg.Buffer(out))
        np.testing.assert_array_equal(out, 3 * a)

    def test_by_name(self):
        call = self.f.compile_to_callable([self.image, self.gain])
        a, out = np.arange(6, dtype=np.float32).reshape(2, 3), np.zeros((2, 3), np.float32)
        call(a, f=out, gain=2)
        np.testing.assert_array_equal(out, 2 * a)
        call(f=out, gain=3, image=a)
        np.testing.assert_array_equal(out, 3 * a)
        for arguments, named, words in (((a, 2), {"out": out}, '"out" is none of them'),
                                        ((a, 2, out), {"gain": 3}, '"gain" is given twice'),
                                        ((a,), {"f": out}, '"gain" is missing'),
                                        ((a, 2, out, out), {"f": out}, "4 were given")):
            with self.assertRaisesRegex(TypeError, f"takes image, gain, f: {words}"):
                call(*arguments, **named)

    def test_any_strides(self):
        call = rg.Pipeline(self.f).compile_to_callable([self.image, self.gain])
        a, out = np.arange(24, dtype=np.float32).reshape(4, 6), np.zeros((3, 2), np.float32)
        call(a[:2, ::2], 2, out.T)
        np.testing.assert_array_equal(out.T, 2 * a[:2, ::2])

    def test_strides_of_short_rows(self):
        points, f = rg.ImageParam("float32", 2, "points"), rg.Func("f")
        f[x, y] = 2 * points[x, y]
        for buffer in (points, f.output_buffer()):
            buffer.dim(0).set_bounds(0, 3)
        call, again = (rg.Pipeline(f).compile_to_callable([points]) for _ in range(2))
        a = np.arange(40 * 5, dtype=np.float32).reshape(40, 5)
        for given, result in ((a[:, :3].copy(), np.zeros((40, 3), np.float32)), (a[:, :3], np.zeros((40, 3), np.float32)),
                              (a[::2, 1:4].copy(), np.zeros((20, 7), np.float32)[:, 2:5]),
                              (a[:, :3].copy(), np.zeros((40, 3), np.float32))):
            for either in (call, again):
                result[:] = 0
                either(given, result)
                np.testing.assert_array_equal(result, 2 * given)
        points.dim(1).set_stride(3)  # the user's own promise
        with self.assertRaisesRegex(rg.RuntimeError, "stride"):
            rg.Pipeline(f).compile_to_callable([points])(a[:, :3], np.zeros((40, 3), np.float32))

    def test_refusals(self):
        call = self.f.compile_to_callable([self.image, self.gain])
        a = np.zeros((2, 3), np.float32)
        with self.assertRaisesRegex(rg.RuntimeError, "its arguments, then its output buffers"):
            call(a, 2)
        fixed = a.copy()
        fixed.flags.writeable = False
        with self.assertRaises(rg.Error):
            call(a, 2, fixed)
        with self.assertRaises(TypeError):
            call(a, "loud", a.copy())
        with self.assertRaisesRegex(TypeError, '"f" is an array, not \'loud\''):
            call(a, 2, "loud")
        with self.assertRaisesRegex(rg.CompileError, "all that the outputs need"):
            self.f.compile_to_callable([self.image])


class Modules(unittest.TestCase):
    def test_functions_on_their_way_to_files(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x] + 1
        target = rg.get_host_target()
        module = f.compile_to_module([image], "plus_one", target)
        self.assertEqual([fn.name for fn in module.functions()], ["plus_one"])
        function = module.get_function_by_name("plus_one")
        self.assertEqual(([a.name for a in function.args], function.linkage),
                         (["image", f.name()], rg.LinkageType.ExternalPlusMetadata))
        module.remap_metadata_name("image", "photo")
        self.assertEqual(module.get_metadata_name_map(), {"image": "photo"})
        both = rg.Module("both", target)
        both.append(function)
        both.append(module)
        self.assertEqual((both.name(), both.target(), len(both.submodules()), both.any_strict_float()),
                         ("both", target, 1, False))
        self.assertEqual(bytes(module.compile_to_buffer())[:4], b"\x7fELF")
        self.assertIn("both", repr(both))
        linked = rg.link_modules("linked", [module])
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder, "f.o"))
            linked.compile({rg.OutputFileType.object: path})
            self.assertTrue(os.path.getsize(path))
            path = str(Path(folder, "runtime.a"))
            rg.compile_standalone_runtime({rg.OutputFileType.static_library: path}, target)
            self.assertTrue(os.path.getsize(path))

    def test_of_several_targets(self):
        f = rg.Func("f")
        f[x] = x
        made = []

        def make(name, target):
            made.append(target.to_string())
            return f.compile_to_module([], name, target)

        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder, "f.a"))
            targets = [rg.Target("x86-64-linux-avx2"), rg.Target("x86-64-linux")]
            rg.compile_multitarget("f", {rg.OutputFileType.static_library: path}, targets, ["", ""], make)
            self.assertTrue(os.path.getsize(path))
        self.assertEqual(len([t for t in made if "avx2" in t]), 1)
        info = rg.get_output_info(rg.get_host_target())[rg.OutputFileType.object]
        self.assertEqual((info.name, info.extension), ("object", ".o"))


class CFunctions(unittest.TestCase):
    def test_in_expressions(self):
        f = rg.Func("f")
        f[x] = rg.call_c_function("labs", "int64", [rg.i64(x) - 3])
        np.testing.assert_array_equal(f.realize([5]), [3, 2, 1, 0, 1])

    def test_of_ctypes(self):
        signature = ctypes.CFUNCTYPE(ctypes.c_float, ctypes.c_float)
        twice = signature(lambda value: 2 * value)
        f = rg.Func("f")
        f[x] = rg.call_c_function("twice", "float32", [rg.f32(x)])
        extern = rg.ExternCFunction(twice, rg.ExternSignature("float32", ["float32"]))
        self.assertEqual(extern.address(), ctypes.cast(twice, ctypes.c_void_p).value)
        self.assertEqual(extern.signature().arg_types(), [rg.Float(32)])
        f.set_jit_externs({"twice": rg.JITExtern(extern)})
        del twice, extern
        np.testing.assert_array_equal(f.realize([4]), [0, 2, 4, 6])
        self.assertEqual(f.get_jit_externs()["twice"].extern_c_function().signature().ret_type(), rg.Float(32))

    def test_stages_computed_outside(self):
        Image = ctypes.POINTER(runtime.halide_buffer_t)

        def times_ten(source, result):
            source, result = source[0], result[0]
            if not source.host:  # which region of the source?
                source.dim[0].min, source.dim[0].extent = result.dim[0].min, result.dim[0].extent
            else:
                a, b = (ctypes.cast(i.host, ctypes.POINTER(ctypes.c_int32)) for i in (source, result))
                for n in range(result.dim[0].extent):
                    b[n] = 10 * a[n]
            return 0

        signature = ctypes.CFUNCTYPE(ctypes.c_int, Image, Image)
        g, outer = rg.Func("g"), rg.Func("outer")
        g[x] = x + 1
        g.compute_root()
        outer.define_extern("times_ten", [g], "int32", 1)
        self.assertTrue(outer.is_extern())
        types = rg.ExternSignature("int32", [rg.Handle(), rg.Handle()])
        self.assertFalse(types.is_void_return())
        outer.set_jit_externs({"times_ten": rg.JITExtern(rg.ExternCFunction(signature(times_ten), types))})
        np.testing.assert_array_equal(outer.realize([3]), [10, 20, 30])
        image, tens, by_func = rg.ImageParam("int32", 1), rg.Func("tens"), rg.Func("by_func")
        tens[x] = 10 * image[x]
        by_func.define_extern("tens_of", [g], "int32", 1)
        by_func.set_jit_externs({"tens_of": rg.JITExtern(tens)})
        np.testing.assert_array_equal(by_func.realize([3]), [10, 20, 30])
        self.assertTrue(rg.ExternFuncArgument(g).is_func())
        self.assertTrue(rg.ExternFuncArgument(rg.ImageParam("int32", 1)).is_image_param())
        self.assertTrue(rg.ExternFuncArgument(3).is_expr())
        self.assertTrue(rg.ExternFuncArgument(np.zeros(3)).is_buffer())


class Handlers(unittest.TestCase):
    def test_print_is_a_function_of_python(self):
        said = []
        f = rg.Func("f")
        f[x] = rg.print(x, "is x")
        f.jit_handlers().print = said.append
        f.realize([2])
        self.assertEqual(said, ["0 is x\n", "1 is x\n"])

    def test_others_are_of_ctypes(self):
        said = []
        signature = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p)
        f = rg.Func("f")
        f[x] = rg.print(x)
        handlers = f.jit_handlers()
        self.assertIsNone(handlers.custom_print)
        handlers.custom_print = signature(lambda context, message: said.append(message))
        f.realize([1])
        self.assertEqual(said, [b"0\n"])
        handlers.custom_print = None
        self.assertIsNone(handlers.custom_print)
        handlers.thread_limit = 1
        self.assertEqual(f.jit_handlers().thread_limit, 1)
        with self.assertRaisesRegex(TypeError, "an address or a function of ctypes"):
            handlers.custom_trace = print


class Watching(unittest.TestCase):
    def test_warnings(self):
        f = rg.Func("f")
        f[x] = x
        f[x] += 1
        f.vectorize(x, 4)
        self.assertTrue(any("update" in warning for warning in rg.warnings_of(rg.Pipeline(f))))

    def test_passes(self):
        f = rg.Func("watched")
        f[x] = x
        with rg.PassObserver(text=True) as observer:
            f.compile_jit()
        reports = [r for r in observer.reports if r.pipeline.startswith("watched")]
        self.assertTrue(any("watched" in r.text for r in reports))
        self.assertTrue(all(r.seconds >= 0 and r.pass_ for r in reports))
        count = len(observer.reports)
        f[x] += 1
        f.compile_jit()
        self.assertEqual(len(observer.reports), count)

    def test_cache_on_disk(self):
        with tempfile.TemporaryDirectory() as folder:
            rg.set_compile_cache_directory(folder)
            try:
                f = rg.Func("f")
                f[x] = x * 7
                f.realize([3])
                self.assertTrue(any(Path(folder).iterdir()))
            finally:
                rg.set_compile_cache_directory("")
        self.assertEqual(rg.default_compile_cache_bytes, 10**9)


class Values(unittest.TestCase):
    def test_evaluate(self):
        self.assertEqual(rg.evaluate(rg.i32(3) + 4), 7)
        self.assertEqual(rg.evaluate((rg.f32(1.5), 2)), (1.5, 2))


if __name__ == "__main__":
    unittest.main()
