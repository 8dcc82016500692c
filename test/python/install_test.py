"""pip installs, runs and uninstalls the package in a fresh virtual environment, with Debian's packages alone."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import numpy, retrograde as rg
assert rg.__file__.startswith({prefix!r}), rg.__file__
x = rg.Var("x")
p, f = rg.Param("float32", "p", 3.0), rg.Func("f")
f[x] = p * p * rg.f32(x)
loss, r = rg.Func("loss"), rg.RDom([(0, 4)])
loss[()] += f[r]
print(numpy.asarray(f.realize([4])), rg.propagate_adjoints(loss)(p).realize()[()])
"""


def run(*command, **more):
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, env=environment, **more)
    if done.returncode:
        raise AssertionError(f"{command} failed:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


class Install(unittest.TestCase):
    def test_from_the_checkout_and_away_again(self):
        with tempfile.TemporaryDirectory() as folder:
            venv, elsewhere = Path(folder, "venv"), Path(folder, "elsewhere")
            elsewhere.mkdir()
            run(sys.executable, "-m", "venv", "--system-site-packages", venv)
            python = venv / "bin/python"
            site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
            before = sorted(p.name for p in site.iterdir())
            run(python, "-m", "pip", "install", "--no-build-isolation", "--no-index", "--no-deps", ROOT, cwd=elsewhere)
            shown = run(python, "-m", "pip", "show", "retrograde")
            self.assertIn("License: MIT", shown)
            program = PROGRAM.format(prefix=str(venv))
            self.assertEqual(run(python, "-c", program, cwd=elsewhere).strip(), "[ 0.  9. 18. 27.] 36.0")
            self.check_symbols(site / "retrograde")
            run(python, "-m", "pip", "uninstall", "-y", "retrograde")
            self.assertEqual(sorted(p.name for p in site.iterdir()), before)

    def test_the_runtime_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            venv = Path(folder, "venv")
            run(sys.executable, "-m", "venv", "--system-site-packages", venv)
            command = [venv / "bin/python", "-m", "pip", "install", "--no-build-isolation", "--no-index", "--no-deps", ROOT]
            run("env", "RETROGRADE_RUNTIME_ONLY=1", *command, cwd=folder)
            program = "from retrograde import runtime; import retrograde; print(retrograde.__file__, runtime.Function)"
            self.assertIn(str(venv), run(venv / "bin/python", "-c", program, cwd=folder))
            package = next(venv.glob("lib/*/site-packages/retrograde"))
            self.assertEqual([p.name for p in package.iterdir() if p.suffix == ".so"], [])

    def test_a_wheel(self):
        """One of this machine's C library and interpreter, with all that the package is made of."""
        with tempfile.TemporaryDirectory() as folder:
            run(sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-index", "--no-deps", "-w", folder, ROOT)
            wheel, = Path(folder).iterdir()
            glibc = os.confstr("CS_GNU_LIBC_VERSION").split()[1].replace(".", "_")
            self.assertRegex(wheel.name, rf"retrograde-[\d.]+-cp3\d+-cp3\d+-manylinux_{glibc}_{os.uname().machine}.whl")
            names = run(sys.executable, "-m", "zipfile", "-l", wheel)
            for part in ("retrograde/libretrograde.so.0 ", "retrograde/runtime.py", "retrograde/py.typed",
                         "retrograde/__init__.pyi", "retrograde/torch/_library.py"):
                self.assertIn(part, names)

    def test_a_build_of_its_own_is_configured(self):
        """What setup.py asks of CMake where no build is named; building it takes minutes, and is no other build."""
        with tempfile.TemporaryDirectory() as build:
            run("cmake", "--preset", "wheel", "-B", build, "-D", f"Python_EXECUTABLE={sys.executable}", cwd=ROOT)
            targets = run("ninja", "-C", build, "-t", "targets", "all")
            self.assertIn("retrograde_python:", targets)
            self.assertNotIn("bilateral_slice", targets)

    def check_symbols(self, package):
        """The module shows one symbol, and its library is the one beside it, which is there once."""
        self.assertEqual(len(list(package.glob("libretrograde*"))), 1)
        module = next(package.glob("_retrograde.*.so"))
        symbols = [line.split()[-1] for line in run("nm", "-D", "--defined-only", module).splitlines()]
        self.assertEqual(symbols, ["PyInit__retrograde"])
        loaded = run("ldd", module)
        line = next(line for line in loaded.splitlines() if "libretrograde" in line)
        self.assertIn(str(package), line)
        self.check_library(package / "libretrograde.so.0")

    def check_library(self, library):
        """LLVM is inside and hidden; what it needs beyond the C library lies beside it."""
        needed = re.findall(r"NEEDED.*\[(.*)\]", run("readelf", "-d", library))
        outside = [n for n in needed if not re.match(r"lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+)\.so|ld-linux", n)]
        self.assertTrue(all((library.parent / n).exists() for n in outside), outside)
        shown = run("nm", "-DC", "--defined-only", library)
        self.assertNotRegex(shown, r" [TV] (llvm::|LLVM)")


if __name__ == "__main__":
    unittest.main()
