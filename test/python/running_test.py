"""Running: outputs, Pipelines, files; without the GIL, and open to Ctrl-C."""
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import unittest
from pathlib import Path

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


def slow(seconds, parallel=False):
    """A Func of which one element takes about so long; measured on this machine."""
    def sum_of(n):
        f, r = rg.Func("slow"), rg.RDom([(0, n)], "r")
        f[x] = rg.f64(0)
        f[x] += rg.sin(f[x] + rg.f64(r.x))
        if parallel:
            f.update().parallel(x)
        return f
    n = 1 << 18
    f = sum_of(n)
    f.compile_jit()
    begin = time.perf_counter()
    f.realize([1])
    return sum_of(int(n * seconds / (time.perf_counter() - begin)) + 1)


class Outputs(unittest.TestCase):
    def test_of_a_func(self):
        f = rg.Func("f")
        f[x, y] = x + 10 * y
        self.assertEqual(f.realize([3, 2]).shape, (2, 3))
        self.assertEqual(f.realize((np.int64(3), 2)).shape, (2, 3))
        a = np.zeros((2, 3), np.int32)
        self.assertIsNone(f.realize(a))
        f.realize([rg.Buffer(a)])
        self.assertEqual(a[1, 2], 12)
        with self.assertRaisesRegex(rg.RuntimeError, "one size for each dimension"):
            f.realize([3])
        with self.assertRaisesRegex(TypeError, "not both"):
            f.realize([a, 3])

    def test_of_a_pipeline(self):
        f, g = rg.Func("f"), rg.Func("g")
        f[x] = x
        g[x] = rg.f32(f[x]) / 2
        p = rg.Pipeline([f, g])
        a, b = p.realize([4])
        np.testing.assert_array_equal(a, range(4))
        np.testing.assert_array_equal(b, np.arange(4) / 2)
        again = np.zeros(4, np.int32), np.zeros(4, np.float32)
        p.realize(again)
        np.testing.assert_array_equal(again[1], b)
        self.assertEqual([o.name() for o in p.outputs()], [f.name(), g.name()])
        self.assertTrue(p.get_func(0).same_as(f))
        self.assertEqual(repr(p), f"<retrograde.Pipeline of {f.name()}, {g.name()}>")
        self.assertTrue(p.defined())
        p.invalidate_cache()
        p.compile_jit()
        self.assertIn("produce f", p.loop_nest())

    def test_requirements(self):
        n = rg.Param("int32", "n", 1)
        f = rg.Func("f")
        f[x] = x + n
        p = rg.Pipeline(f)
        p.add_requirement(n > 1, "n is only ", n)
        with self.assertRaisesRegex(rg.RuntimeError, "n is only 1"):
            p.realize([2])
        n.set(2)
        np.testing.assert_array_equal(p.realize([2]), [2, 3])

    def test_arguments(self):
        image, gain = rg.ImageParam("float32", 2, "image"), rg.Param("float32", "gain")
        f = rg.Func("f")
        f[x, y] = image[x, y] * gain
        arguments = f.infer_arguments()
        self.assertEqual({(a.name, a.is_buffer(), a.dimensions) for a in arguments},
                         {("image", True, 2), ("gain", False, 0)})
        self.assertTrue(all(a.is_input() and not a.is_output() for a in arguments))


class Files(unittest.TestCase):
    def test_every_kind(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x] + 1
        with tempfile.TemporaryDirectory() as folder:
            path = lambda name: str(Path(folder, name))
            f.compile_to_object(path("f.o"), [image], "f")
            f.compile_to_bitcode(path("f.bc"), [image])
            f.compile_to_llvm_assembly(path("f.ll"), [image])
            f.compile_to_assembly(path("f.s"), [image])
            f.compile_to_header(path("f.h"), [image], "f")
            f.compile_to_lowered_stmt(path("f.stmt"), [image])
            f.compile_to_lowered_stmt(path("f.html"), [image], rg.StmtOutputFormat.HTML)
            f.compile_to_file(path("file"), [image], "f")
            f.compile_to_static_library(path("static"), [image], "f")
            f.compile_to({rg.OutputFileType.object: path("g.o")}, [image], "g", "host-no_runtime")
            f.compile_to_multitarget_static_library(path("multi"), [image], ["x86-64-linux-avx2", "x86-64-linux"])
            files = {p.name for p in Path(folder).iterdir() if p.stat().st_size > 0}
        self.assertLessEqual({"f.o", "f.bc", "f.ll", "f.s", "f.h", "f.stmt", "f.html", "file.o", "file.h", "static.a",
                              "static.h", "g.o", "multi.a", "multi.h"}, files)

    def test_a_folder_that_is_not_there(self):
        f = rg.Func("f")
        f[x] = 0
        with self.assertRaisesRegex(rg.Error, "exist and be writable"):
            f.compile_to_object("/no/such/folder/f.o", [], "f")


class Threads(unittest.TestCase):
    def test_python_goes_on_meanwhile(self):
        f = slow(0.5)
        f.compile_jit()
        counts, stop = [0], threading.Event()

        def count():
            while not stop.is_set():
                counts[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        before = counts[0]
        f.realize([1])
        during = counts[0] - before
        stop.set()
        thread.join()
        self.assertGreater(during, 10)

    def test_many_threads_run_and_compile_at_once(self):
        results = {}

        def work(i):
            f = rg.Func("f")
            f[x] = x * i
            for _ in range(5):
                results[i] = np.asarray(f.realize([100])).sum()

        threads = [threading.Thread(target=work, args=(i,)) for i in range(8)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(results, {i: 4950 * i for i in range(8)})

    def test_a_child_of_fork_runs(self):
        f = rg.Func("f")
        f[x] = x
        f.realize([3])
        child = os.fork()
        if child == 0:
            g = rg.Func("g")
            g[x] = x + 1
            os._exit(0 if g.realize([3])[2] == 3 else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)


class Interruptions(unittest.TestCase):
    PROGRAM = textwrap.dedent("""
        import os, sys, threading, time
        sys.path.insert(0, {folder!r})
        from running_test import slow
        f = slow(20)
        f.compile_jit()
        threading.Timer(0.3, lambda: os.kill(os.getpid(), {signal})).start()
        begin = time.perf_counter()
        try:
            f.realize([1])
        except KeyboardInterrupt:
            print("interrupted after", time.perf_counter() - begin, flush=True)
            g = slow(0.01)
            print("and goes on:", g.realize([1]).dimensions(), flush=True)
            os._exit(7)
    """)

    def run_program(self, signal_sent):
        program = self.PROGRAM.format(folder=str(Path(__file__).parent), signal=int(signal_sent))
        return subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, timeout=60)

    def test_control_c_ends_the_wait(self):
        done = self.run_program(signal.SIGINT)
        self.assertEqual(done.returncode, 7, done.stderr)
        seconds = float(done.stdout.split()[2])
        self.assertLess(seconds, 5)
        self.assertIn("goes on: 1", done.stdout)


if __name__ == "__main__":
    unittest.main()
