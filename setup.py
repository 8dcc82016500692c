"""The Python package, for pip: CMake builds the library and the extension module, and copies them into the wheel.

    pip install .                                         # in a virtual environment
    pip install --no-build-isolation --no-index .         # with Debian's packages alone (tools/packages.list)

RETROGRADE_RUNTIME_ONLY=1 leaves the compiler out: retrograde.runtime, which is Python alone.
RETROGRADE_BUILD_DIR names a build of this checkout to take them from, instead of one of its own (preset `wheel`, in
out/python-build).
"""
import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
OUT = Path("out/python-build")  # relative to ROOT, as setuptools wants it


def version():
    return re.search(r"project\(retrograde VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


class BuildByCMake(build_ext):
    def run(self):
        given = os.environ.get("RETROGRADE_BUILD_DIR")
        build = Path(given) if given else ROOT / OUT / "cmake"
        if not given:
            import pybind11
            subprocess.run(
                ["cmake", "--preset", "wheel", "-B", build.resolve(), "-D", f"Python_EXECUTABLE={sys.executable}",
                 "-D", f"pybind11_DIR={pybind11.get_cmake_dir()}"],
                cwd=ROOT, check=True)
        subprocess.run(["cmake", "--build", build, "--parallel", str(os.cpu_count()),
                        "--target", "python_package"], check=True)
        subprocess.run(["cmake", "--install", build, "--component", "python", "--strip",
                        "--prefix", Path(self.build_lib).resolve()], check=True)


def parts():
    if os.environ.get("RETROGRADE_RUNTIME_ONLY") == "1":
        names = ("__init__", "_errors", "runtime")
        return {"py_modules": [f"retrograde.{name}" for name in names],
                "package_dir": {"retrograde": "python_bindings/retrograde"}}
    return {"ext_modules": [Extension("retrograde._retrograde", sources=[])], "cmdclass": {"build_ext": BuildByCMake}}


def platform_tag():
    """For the C library of this machine and later ones."""
    libc = os.confstr("CS_GNU_LIBC_VERSION").split()[1].replace(".", "_")
    return f"manylinux_{libc}_{os.uname().machine}"


def options():
    made = {"build": {"build_base": str(OUT / "build")}, "egg_info": {"egg_base": str(OUT)}}
    return made if "py_modules" in parts() else made | {"bdist_wheel": {"plat_name": platform_tag()}}


(ROOT / OUT).mkdir(parents=True, exist_ok=True)
setup(version=version(), packages=[], options=options(), zip_safe=False, **parts())
