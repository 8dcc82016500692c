"""The programs of docs/performance.md run as they stand; the forms of each section agree in values and gradients."""
import re
import unittest
from pathlib import Path

import numpy as np
import retrograde as rg

PAGE = Path(__file__).resolve().parents[2] / "docs/performance.md"


def sections():
    """(title, its blocks of Python), in order."""
    parts = re.split(r"^## (.+)$", PAGE.read_text(), flags=re.M)
    for title, text in zip(["preamble", *parts[1::2]], parts[::2]):
        yield title, re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)


def values_for(inputs):
    """Random values for inputs of these sizes, dimension 0 first; the same for the same names."""
    random, values = np.random.default_rng(5), {}
    for parameter, sizes in sorted(inputs.items(), key=lambda item: item[0].name()):
        shape = tuple(reversed(sizes))
        if parameter.type().is_float():
            values[parameter] = random.random(shape, "float32")
        else:
            values[parameter] = random.integers(0, 8, shape, "int32")
    return values


def results_of(program):
    """Values of the outputs, then gradients by all inputs of floats, of a program of the page."""
    outputs, inputs, sizes = program
    outputs = outputs if isinstance(outputs, list) else [outputs]
    for parameter, value in values_for(inputs).items():
        parameter.set(value if value.shape else float(value))
    seed = np.asarray(np.random.default_rng(6).random(tuple(reversed(sizes)), "float32"))
    bounds = [(0, size) for size in sizes]
    wanted = [parameter for parameter in inputs if parameter.type().is_float()]
    derivative = rg.propagate_adjoints([(f, rg.Func(rg.Buffer(seed)), bounds) for f in outputs],
                                       rg.AdjointOptions(wrt=wanted))
    results = [np.asarray(f.realize(list(sizes))) for f in outputs]
    return results + [np.asarray(derivative(parameter).realize(list(inputs[parameter]))) for parameter in wanted]


class Page(unittest.TestCase):
    def test_forms_of_a_section_agree(self):
        names, compared = {}, 0
        for title, blocks in sections():
            found = []
            for block in blocks:
                exec(compile(block, f"{PAGE.name}: {title}", "exec"), names)
                if "program" in names:
                    found.append(results_of(names.pop("program")))
            with self.subTest(title):
                for other in found[1:]:
                    compared += 1
                    self.assertEqual(len(other), len(found[0]))
                    for one, two in zip(found[0], other):
                        np.testing.assert_allclose(one, two, rtol=1e-4, atol=1e-5)
        self.assertGreaterEqual(compared, 6)

    def test_its_explanations(self):
        f, x = rg.Func("explained"), rg.Var("x")
        image = rg.ImageParam("float32", 1, "image")
        f[x] = rg.exp(image[x])
        self.assertIn('"explained"', rg.explain(f, [640], {"image": [640]}))
        self.assertGreater(f.explain_schedule(rg.get_host_target(), [640]).predicted_ms, 0)


if __name__ == "__main__":
    unittest.main()
