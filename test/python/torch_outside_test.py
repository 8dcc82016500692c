"""The programs of bench/outside at a small size: results and gradients in float32 agree with PyTorch's in float64.

    torch_outside_test.py FIELD [unittest's arguments]

FIELD is a module of bench/outside. Ends with 77, which ctest counts as skipped, where there is no PyTorch."""
import sys
import unittest
from pathlib import Path

try:
    import torch  # noqa: F401
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

BENCH = Path(__file__).resolve().parents[2] / "bench"
sys.path[:0] = [str(BENCH / "outside"), str(BENCH / "torch")]
import sides
from programs import FIELD_OF, HELD_OUT, PROGRAMS

FIELD = sys.argv.pop(1)


class Programs(unittest.TestCase):
    def test_results_and_gradients(self):
        for program in (PROGRAMS[name] for name, field in FIELD_OF.items() if field == FIELD):
            with self.subTest(program.name):
                case = sides.Case(program.pytorch, program.inputs(sides.uniform(1), True), program.constants)
                operator = program.operator([tuple(t.shape) for t in case.tensors], "tests")
                ours = sides.Side("ours", operator, case)
                both = ours.both()
                for error in case.errors(both):
                    self.assertLess(error, program.tolerance)
                for forward, result in zip(sides.as_list(ours.forward()), both):
                    self.assertTrue(torch.equal(forward, result))

    def test_some_of_each_field_but_not_all_are_held_out(self):
        names = {name for name, field in FIELD_OF.items() if field == FIELD}
        self.assertTrue(names & set(HELD_OUT))
        self.assertTrue(names - set(HELD_OUT))
        self.assertLessEqual(set(HELD_OUT), set(PROGRAMS))


if __name__ == "__main__":
    unittest.main()
