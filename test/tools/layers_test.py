"""The check of layers: includes that go up in the layer diagram are reported, those that go down are not."""
import sys
import tempfile
import unittest
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True

loader = SourceFileLoader("check_layers", str(ROOT / "tools/check_layers"))
check_layers = module_from_spec(spec_from_loader(loader.name, loader))
loader.exec_module(check_layers)


def found(files, depends):
    """What the check reports of a library of these files, and layers with these dependencies."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for layer, below in {"../runtime": "", "../autoschedule": "graph", **depends}.items():
            place = root / "compiler" / layer
            place.mkdir(parents=True)
            (place / "CMakeLists.txt").write_text(f"retrograde_layer(x SOURCES DEPENDS {below})\n")
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        return check_layers.findings(root)[1]


LAYERS = {"graph": "", "frontend": "graph", "transform": "frontend", "jit": "frontend",
          "driver": "jit transform"}


class Layers(unittest.TestCase):
    def test_includes_of_lower_layers_are_allowed(self):
        self.assertEqual(found({"compiler/driver/a.cpp": '#include "transform/b.h"\n#include "graph/c.h"\n'}, LAYERS), [])

    def test_the_autoscheduler_may_not_include_the_driver(self):
        self.assertEqual(found({"compiler/transform/a.cpp": '\n#include "driver/schedule.h"\n'}, LAYERS),
                         ["compiler/transform/a.cpp:2: transform may not include driver/schedule.h"])

    def test_code_in_process_may_not_include_the_autoscheduler(self):
        self.assertEqual(found({"compiler/jit/a.h": '#include "transform/size_estimate.h"\n'}, LAYERS),
                         ["compiler/jit/a.h:1: jit may not include transform/size_estimate.h"])

    def test_only_the_front_end_calls_the_driver_through_its_interface(self):
        include = f'#include "{check_layers.INTERFACE}"\n'
        self.assertEqual(found({"compiler/frontend/run/a.cpp": include, "compiler/driver/a.cpp": include}, LAYERS), [])
        self.assertEqual(found({"compiler/transform/a.cpp": include}, LAYERS),
                         [f"compiler/transform/a.cpp:1: transform may not call the compiler through "
                          f"{check_layers.INTERFACE}"])

    def test_parts_of_the_planner_include_only_parts_before_them(self):
        self.assertEqual(found({"autoschedule/plan/a.cpp": '#include "autoschedule/access/b.h"\n'}, LAYERS), [])
        self.assertEqual(found({"autoschedule/access/a.cpp": '#include "autoschedule/plan/b.h"\n'}, LAYERS),
                         ["autoschedule/access/a.cpp:1: planning may not include autoschedule/plan/b.h"])

    def test_layers_in_a_cycle_are_reported(self):
        self.assertEqual(found({}, {"ir": "simplify", "simplify": "ir"}), ["ir and simplify depend on each other"])


if __name__ == "__main__":
    unittest.main()
