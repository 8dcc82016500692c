"""Generators written in Python: in process, inside of other pipelines, from a command line; libraries run by
retrograde.runtime, also where there is no compiler."""
import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path

import numpy as np
import retrograde as rg
from retrograde import runtime

x, y = rg.Var("x"), rg.Var("y")


@rg.generator(name="brighten")
class Brighten:
    gain = rg.GeneratorParam(2.0, min=0)
    clamped = rg.GeneratorParam(False)
    order = rg.GeneratorParam("plain", choices=["plain", "tiled"])
    tail = rg.GeneratorParam(rg.TailStrategy.GuardWithIf)
    image = rg.InputBuffer("float32", 2)
    offset = rg.InputScalar("float32", 1.0, min=0, max=10)
    bright = rg.OutputBuffer("float32", 2)

    def generate(self):
        value = self.image[x, y] * self.gain + self.offset
        self.bright[x, y] = rg.clamp(value, 0, 1) if self.clamped else value
        if not self.using_autoscheduler():
            self.bright.compute_root().vectorize(x, self.natural_vector_size("float32"), self.tail)


@rg.generator()
class Several(rg.Generator):
    images = rg.InputBuffer(count=2)
    total = rg.OutputBuffer()
    count = rg.OutputScalar("int32")

    def configure(self):
        self.port("total").types, self.port("total").dimensions = self.port("images").types, 1
        self.add_input("scale", rg.InputScalar("int32"))

    def generate(self):
        a, b = self.images
        self.total[x] = a[x] + b[x] * rg.cast(a.type(), self.scale)
        self.count[()] = len(self.images)


@rg.alias(tripled={"factor": 3}, tripled_by_rules={"factor": 3, "autoscheduler": "Mullapudi2016"})
@rg.generator()
class Doubled:
    factor = rg.GeneratorParam(2)
    image = rg.InputBuffer(int, 2)
    offset = rg.InputScalar(float)
    out = rg.OutputBuffer("int32", 2)

    def generate(self):
        self.out[x, y] = self.image[x, y] * self.factor + rg.cast("int32", self.offset)


A = np.arange(12, dtype=np.float32).reshape(3, 4)


class InProcess(unittest.TestCase):
    def test_realize(self):
        g = Brighten(gain=3)
        image, offset = g.inputs()
        image.set(A)
        np.testing.assert_array_equal(g.realize([4, 3]), 3 * A + 1)
        offset.set(5)
        np.testing.assert_array_equal(g.realize([4, 3]), 3 * A + 5)
        self.assertEqual([f.name().split("$")[0] for f in g.outputs()], ["bright"])
        self.assertIn("vectorized", g.outputs()[0].loop_nest())
        self.assertEqual(repr(g), '<retrograde.Generator "brighten">')

    def test_as_a_callable(self):
        out = np.zeros_like(A)
        Brighten(clamped=True).compile_to_callable()(A, 0.5, out)
        np.testing.assert_array_equal(out, np.clip(2 * A + 0.5, 0, 1))

    def test_by_its_name(self):
        out = np.zeros_like(A)
        rg.create_callable_from_generator(rg.get_host_target(), "brighten", {"gain": 4.0})(A, 0, out)
        np.testing.assert_array_equal(out, 4 * A)
        with self.assertRaisesRegex(rg.CompileError, "there are brighten"):
            rg.create_callable_from_generator(rg.get_host_target(), "dim")

    def test_by_its_aliases(self):
        out, image = np.zeros((3, 4), np.int32), np.arange(12, dtype=np.int32).reshape(3, 4)
        for name, factor in (("Doubled", 2), ("tripled", 3), ("tripled_by_rules", 3)):
            rg.create_callable_from_generator(rg.get_host_target(), name)(image, 1.0, out)
            np.testing.assert_array_equal(out, factor * image + 1)
        rg.create_callable_from_generator(rg.get_host_target(), "tripled", {"factor": 5})(image, 0.0, out)
        np.testing.assert_array_equal(out, 5 * image)
        self.assertEqual([i.type() for i in Doubled().inputs()], [rg.Int(32), rg.Float(32)])

    def test_a_scheduler_of_halide_means_the_built_in_one(self):
        g = Brighten(autoscheduler="Adams2019", **{"autoscheduler.parallelism": 4})
        self.assertTrue(g.using_autoscheduler())
        self.assertIn("vectorized", g.outputs()[0].loop_nest())
        params = rg.AutoschedulerParams("Adams2019", {"parallelism": 8})
        self.assertEqual(params.to_string(), "autoscheduler=Adams2019 autoscheduler.parallelism=8")
        f = rg.Func()
        f[x, y] = rg.f32(x) * y
        f.set_estimates([(0, 640), (0, 480)])
        pipeline = rg.Pipeline(f)
        pipeline.apply_autoscheduler(rg.get_host_target(), params)
        self.assertIn("vectorized", f.loop_nest())

    def test_requirements(self):
        class Positive(Brighten):
            def generate(self):
                super().generate()
                self.add_requirement(rg.Expr(self.offset) > 1, "the offset is ", self.offset)
                self.trace_pipeline()

        with self.assertRaisesRegex(rg.RuntimeError, "the offset is 0.5"):
            Positive().compile_to_callable()(A, 0.5, np.zeros_like(A))

    def test_inside_of_another_pipeline(self):
        f = rg.Func("f")
        f[x, y] = rg.f32(x + 4 * y)
        bright = Brighten.call(f, offset=0.5, generator_params={"gain": 10.0})
        np.testing.assert_array_equal(bright.realize([4, 3]), 10 * A + 0.5)
        twice = Brighten.call(Brighten.call(A, 0), 0)
        np.testing.assert_array_equal(twice.realize([4, 3]), 4 * A)
        with self.assertRaisesRegex(TypeError, "brighten was given offset twice"):
            Brighten.call(A, 0, offset=1)
        with self.assertRaisesRegex(TypeError, "brighten takes image, offset"):
            Brighten.call(f)

    def test_types_and_arrays_that_are_left_open(self):
        g = Several(**{"images.type": "int32", "images.dim": 1})
        (a, b), scale = g.inputs()[:2], g.inputs()[2]
        a.set(np.arange(3, dtype=np.int32))
        b.set(np.ones(3, np.int32))
        scale.set(7)
        self.assertEqual([i.name() for i in g.inputs()], ["images_0", "images_1", "scale"])
        module = g.build_module("several")
        self.assertEqual(len(module.functions()[0].args), 5)
        f = g.outputs()[0]
        np.testing.assert_array_equal(f.realize([3]), [7, 8, 9])
        with self.assertRaisesRegex(rg.CompileError, "has a type and dimensions"):
            Several().pipeline()

    def test_autoschedule(self):
        g = Brighten(auto_schedule="true", machine_params="2,1048576,40")
        g.pipeline().get_func(0)
        self.assertTrue(g.using_autoscheduler())
        self.assertEqual(g.machine_params().parallelism, 2)
        self.assertIn("vectorized", g.outputs()[0].loop_nest())

    def test_refusals(self):
        for params, words in (({"gain": -1.0}, "between its limits"), ({"order": "none"}, "one of its choices"),
                              ({"loud": 1}, "a param is one of the generator's"), ({"clamped": "maybe"}, "of type bool"),
                              ({"tail": "Nowhere"}, "of type TailStrategy")):
            with self.assertRaisesRegex(rg.CompileError, words) as caught:
                Brighten(**params)
            self.assertTrue(caught.exception.asked and caught.exception.instead)
        with self.assertRaisesRegex(rg.CompileError, "registered once"):
            rg.generator(name="brighten")(type("Another", (), {}))
        self.assertEqual(Brighten(tail="RoundUp").tail, rg.TailStrategy.RoundUp)


class CommandLine(unittest.TestCase):
    def run_main(self, *words):
        program = "import generators_test, retrograde as rg; rg.main()"
        return subprocess.run([sys.executable, "-B", "-c", program, *words], capture_output=True, text=True,
                              cwd=Path(__file__).parent)

    def test_writes_files(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_main("-g", "brighten", "-f", "bright3", "-o", folder, "-e",
                                 "static_library,c_header,object", "target=host", "gain=3.0")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(sorted(os.listdir(folder)), ["bright3.a", "bright3.h", "bright3.o"])
            self.assertIn("bright3(", Path(folder, "bright3.h").read_text())

    def test_several_targets_and_a_runtime(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_main("-g", "brighten", "-o", folder, "-e", "static_library",
                                 "target=x86-64-linux-avx2,x86-64-linux", "-r", "rt")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(sorted(os.listdir(folder)), ["brighten.a", "rt.a"])

    def test_errors_are_one_line(self):
        for words, message in ((["-g", "dim", "-o", ".", "target=host"], "under; there are brighten"),
                               (["-g", "brighten", "target=host"], "-o names the folder"),
                               (["-g", "brighten", "-o", "."], "target= names"), (["-g"], "every flag has a value"),
                               (["-o", ".", "target=host"], "-g names the generator"),
                               (["-g", "brighten", "-o", ".", "target=host", "-e", "poem"], "the types of -e are"),
                               (["-g", "brighten", "-o", ".", "target=host", "-d", "2"], "-d takes 1"),
                               (["-g", "brighten", "-o", ".", "target=host", "gain=loud"], "of type float"),
                               (["loud"], "flags of one letter")):
            done = self.run_main(*words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(message, done.stderr)
        self.assertIn("usage:", self.run_main("--help").stderr)


@unittest.skipIf("RETROGRADE_SANITIZER" in os.environ, "the runtime that is linked needs the sanitizer")
class Runtime(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.path = str(Path(cls.folder, "libbrighten.so"))
        rg.compile_to_shared_library(Brighten().build_module(), cls.path)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_calls(self):
        brighten = runtime.load(self.path, "brighten")
        out = np.zeros_like(A)
        brighten(A, 1.0, out)
        np.testing.assert_array_equal(out, 2 * A + 1)
        brighten(offset=3, image=A[::-1], bright=out[::-1])
        np.testing.assert_array_equal(out, 2 * A + 3)
        kinds = [(a.name, a.kind, a.dimensions) for a in brighten.arguments]
        self.assertEqual(kinds, [("image", "input", 2), ("offset", "scalar", 0), ("bright", "output", 2)])
        self.assertIn("x86", brighten.target)
        self.assertIn("<input image: float32, 2 dimensions>", repr(brighten))
        self.assertEqual(brighten.required(None, 0, np.zeros((3, 4), np.float32)), {"image": [(0, 4), (0, 3)]})

    def test_errors_are_exceptions(self):
        brighten = runtime.load(self.path, "brighten")
        out = np.zeros_like(A)
        with self.assertRaisesRegex(rg.RuntimeError, '"image" is read over') as caught:
            brighten(A[:, :2], 0, out)
        self.assertLess(caught.exception.code, 0)
        with self.assertRaisesRegex(rg.RuntimeError, "offset"):
            brighten(A, 11, out)
        for args, words in (((A.astype("float64"), 0, out), "holds float32"), ((A[0], 0, out), "has 2 dimensions"),
                            ((A, "loud", out), "offset"), ((A, 0), "needs <output bright"), ((A, 0, out, 1), "takes")):
            with self.assertRaisesRegex((TypeError, ValueError), words):
                brighten(*args)
        fixed = out.copy()
        fixed.flags.writeable = False
        with self.assertRaisesRegex(ValueError, "read-only"):
            brighten(A, 0, fixed)
        with self.assertRaisesRegex(ValueError, "no function dim"):
            runtime.load(self.path, "dim")

    def test_without_the_compiler(self):
        """A folder with the files of retrograde.runtime, and nothing else of the package."""
        package = Path(rg.__file__).parent
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "retrograde").mkdir()
            for name in ("__init__.py", "_errors.py", "runtime.py"):
                shutil.copy(package / name, Path(folder, "retrograde"))
            program = textwrap.dedent(f"""
                import numpy as np
                from retrograde import runtime
                a, out = np.ones((3, 4), "float32"), np.zeros((3, 4), "float32")
                runtime.load({self.path!r}, "brighten")(a, 0.25, out)
                assert (out == 2.25).all()
                import retrograde
                try:
                    retrograde.Func
                except AttributeError as error:
                    print(error)
                maps = open("/proc/self/maps").read()
                print("LLVM" in maps or "libretrograde" in maps)
            """)
            done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, cwd=folder,
                                  env={"PYTHONPATH": folder, "PATH": os.environ["PATH"]})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.splitlines()[-1], "False")
            self.assertIn("runtime alone", done.stdout)

    def test_a_gradient(self):
        g = Brighten()
        module = g.build_gradient_module("brighten_grad")
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder, "g.so"))
            rg.compile_to_shared_library(module, path)
            gradient = runtime.load(path, "brighten_grad")
            names = [a.name for a in gradient.arguments]
            self.assertEqual(names, ["image", "offset", "_grad_loss_for_bright", "_grad_loss_bright_wrt_image"])
            out = np.zeros_like(A)
            gradient(A, 0, A + 1, out)
            np.testing.assert_array_equal(out, 2 * (A + 1))


if __name__ == "__main__":
    unittest.main()
