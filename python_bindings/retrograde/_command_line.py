"""The command line of programs with generators, which build files call. Its flags are those of generators in C++."""
import os
import sys

from . import _retrograde as rg
from ._errors import CompileError, Error, error
from ._generator import generators

__all__ = ["main"]

ASKED = "run a generator"
FLAGS = {"-g": "generator", "-f": "function", "-o": "folder", "-n": "base", "-e": "emit", "-d": "gradient",
         "-p": "plugins", "-s": "scheduler", "-r": "runtime"}


def usage():
    types = ", ".join(info.name for info in rg.get_output_info(rg.get_host_target()).values())
    return f"""usage: [-g GENERATOR] [-f FUNCTION] -o FOLDER [-n FILE_BASE] [-e TYPE,...] [-d 0|1]
       [-p PLUGIN,...] [-s SCHEDULER] [-r RUNTIME]
       target=TARGET[,TARGET...] [param=value ...]
  -g  the generator to run: {", ".join(generators) or "none is registered"}
  -f  name of the function; by default that of the generator
  -n  name of its files without extension; by default that of the function
  -e  files to write: {types}
      by default c_header, static_library and registration
  -d  1: the gradient of the generator's outputs with respect to its images
  -p  shared libraries to load, with autoschedulers
  -s  the scheduler that auto_schedule=true means
  -r  write a runtime of this name
"""


def read(words):
    """The flags and the generator parameters of a command line."""
    flags, params, rest = {}, {}, list(words)
    while rest:
        word = rest.pop(0)
        if word in FLAGS:
            if not rest:
                raise error(CompileError, ASKED, "every flag has a value", f"{word} has none", "Put it after the flag")
            flags[FLAGS[word]] = rest.pop(0)
        elif "=" in word and not word.startswith("-"):
            key, _, value = word.partition("=")
            params[key] = value
        else:
            raise error(CompileError, ASKED, "its arguments are flags of one letter and param=value",
                        f'"{word}" is neither', "See --help")
    return flags, params


def check(flags, params):
    if "generator" not in flags and "runtime" not in flags:
        raise error(CompileError, ASKED, "-g names the generator, or -r a runtime", "neither is given",
                    f"Name one of {', '.join(generators)}")
    if flags.get("generator", next(iter(generators), "")) not in generators and "generator" in flags:
        raise error(CompileError, f'run the generator "{flags["generator"]}"',
                    "a generator is created by the name that it is registered under",
                    f"there are {', '.join(generators) or 'none'}", "Name one of them")
    if "folder" not in flags:
        raise error(CompileError, ASKED, "-o names the folder of its files", "it is missing", "Add -o .")
    if "target" not in params:
        raise error(CompileError, ASKED, "target= names what to compile for", "it is missing",
                    "Add target=host, or for example target=x86-64-linux-avx2")
    if flags.get("gradient", "0") not in ("0", "1"):
        raise error(CompileError, ASKED, "-d takes 1, the gradient, or 0", f'"{flags["gradient"]}" is neither',
                    "Write -d 1 or leave it out")


def files_of(flags, base, default):
    info = {i.name: (kind, i.extension) for kind, i in rg.get_output_info(rg.get_host_target()).items()}
    files = {}
    for word in flags["emit"].split(",") if "emit" in flags else default:
        if word not in info:
            raise error(CompileError, f'emit a file of type "{word}"', f"the types of -e are {', '.join(info)}",
                        f'"{word}" is not one of them', "Name one or more of these, with commas between")
        kind, extension = info[word]
        files[kind] = os.path.join(flags["folder"], base + extension)
    return files


def run(flags, params):
    targets = [rg.Target(text) for text in params.pop("target").split(",")]
    if "runtime" in flags:
        rg.compile_standalone_runtime(files_of(flags, flags["runtime"], ["static_library"]), targets[0])
    if "generator" not in flags:
        return
    made = generators[flags["generator"]]
    function = flags.get("function", flags["generator"])
    base = flags.get("base", function.split("::")[-1])
    files = files_of(flags, base, ["static_library", "c_header", "registration"])

    def build(name, target):
        instance = made(target, **params)
        return instance.build_gradient_module(name) if flags.get("gradient") == "1" else instance.build_module(name)

    if len(targets) == 1:
        build(function, targets[0]).compile(files)
    else:
        rg.compile_multitarget(function, files, targets, [t.to_string() for t in targets], build)


def main(argv=None):
    """Runs the generator that the command line names. An error prints one line to standard error and exits with 1."""
    words = sys.argv[1:] if argv is None else list(argv)
    if not words or {"-h", "--help"} & set(words):
        print(usage(), end="", file=sys.stderr)
        sys.exit(0 if words else 1)
    try:
        flags, params = read(words)
        for plugin in flags.get("plugins", "").split(","):
            if plugin:
                rg.load_plugin(plugin)
        if "scheduler" in flags:
            rg.set_default_autoscheduler_name(flags["scheduler"])
        check(flags, params)
        run(flags, params)
    except Error as problem:
        print(f"Error: {problem}", file=sys.stderr)
        sys.exit(1)
