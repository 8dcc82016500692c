"""Links compiled pipelines into shared libraries, for retrograde.runtime and other programs."""
import os
import subprocess
import tempfile

from . import _retrograde as rg
from ._errors import RuntimeError as RetrogradeError
from ._errors import Unsupported, error

__all__ = ["compile_to_shared_library", "link_shared_library"]


def link_shared_library(filename, static_libraries):
    """Links static libraries into a shared library with the system's C compiler (CC in the environment, or cc). The
    result needs the C library, and libsleef if pipelines use vector math, but not the Retrograde compiler."""
    cc = os.environ.get("CC", "cc")
    command = [cc, "-shared", "-o", str(filename), "-Wl,--whole-archive", *[str(one) for one in static_libraries],
               "-Wl,--no-whole-archive", "-Wl,-z,defs", "-static-libgcc", "-pthread", "-ldl", "-l:libstdc++.a",
               "-Wl,--as-needed", "-lsleef", "-lm"]
    asked = f'link "{filename}"'
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        raise error(Unsupported, asked, "a C compiler links it", f'there is no "{cc}"',
                    "Install one, or name it in CC") from None
    if done.returncode:
        raise error(RetrogradeError, asked, "the linker must succeed", done.stderr.strip().replace("\n", "; "),
                    "See what it says")


def compile_to_shared_library(source, filename, arguments=(), function_name="", target=None):
    """Compiles `source` and the runtime into a shared library. `source` is a Module, or a Func or Pipeline with
    arguments as for compile_to_object."""
    module = source
    if not isinstance(source, rg.Module):
        module = source.compile_to_module(list(arguments), function_name, target)
    with tempfile.TemporaryDirectory() as folder:
        archive = os.path.join(folder, "library.a")
        module.compile({rg.OutputFileType.static_library: archive})
        link_shared_library(filename, [archive])
