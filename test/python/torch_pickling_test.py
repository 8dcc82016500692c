"""Modules that hold operators: deep copies, pickles, files of whole modules, arguments of spawned workers. Ends with 77,
which ctest counts as skipped, where there is no PyTorch."""
import copy
import os
import pickle
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import retrograde as rg

try:
    import torch
    from retrograde.torch import operator
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

import torch_held
from torch_held import Held

x = rg.Var("x")
MARGIN = 2


def blur(name=None):
    """A sum of products with taps, each place of it plus what a Buffer of the program holds there; scheduled."""
    image, taps, f, k = rg.ImageParam("float32", 1, "image"), rg.ImageParam("float32", 1, "taps"), rg.Func("blur"), rg.RDom([(0, 3)])
    added = rg.Buffer("float32", [8], "added")
    added.set_min([-1])
    for i in range(8):
        added[i - 1] = 10.0 * i
    f[x] = added[x]
    f[x] += image[x + k] * taps[k]
    f.update().vectorize(x, 4)
    arguments = f, [image, taps], lambda image, taps: [image.shape[0] - MARGIN]
    return operator(name, *arguments) if name else operator(*arguments)


IMAGE, TAPS = torch.arange(6.0), torch.tensor([1.0, 2.0, 3.0])
WANT = [10.0 * (i + 1) + sum((i + k) * (k + 1) for k in range(3)) for i in range(4)]


def elsewhere(module, tensors):
    """What a process that defines no operator makes of the module: name, result, gradients by weight and image."""
    with tempfile.TemporaryDirectory() as folder:
        files = [str(Path(folder) / name) for name in ("module.pt", "tensors.pt")]
        for thing, file in zip((module, tensors), files):
            torch.save(thing, file)
        run = subprocess.run([sys.executable, "-B", torch_held.__file__, *files], capture_output=True, text=True,
                             env=os.environ, check=False)
    if run.returncode != 0:
        raise AssertionError(run.stderr)
    name, rest = run.stdout.split(" ", 1)
    return name, eval("(" + rest.replace("] ", "], ").replace("0 [", "0, [") + ")")


class Copies(unittest.TestCase):
    def test_of_a_module(self):
        module = Held(blur("pickled::copied"))
        again = copy.deepcopy(module)
        self.assertIs(again.operator, module.operator)
        self.assertIs(copy.copy(module.operator), module.operator)
        again.weight.data.fill_(3)
        self.assertEqual(module(IMAGE, TAPS).tolist(), [2 * v for v in WANT])
        self.assertEqual(again(IMAGE, TAPS).tolist(), [3 * v for v in WANT])

    def test_a_pickle_is_the_operator_where_it_is_known(self):
        for op in (blur("pickled::known"), blur(), operator("pickled::scaled", torch_held.scaled)):
            self.assertIs(pickle.loads(pickle.dumps(op)), op)
        module = pickle.loads(pickle.dumps(Held(op)))
        self.assertIs(module.operator, op)


class OtherProcesses(unittest.TestCase):
    def check(self, op, tensors, want, gradient):
        leaf = tensors[0].clone().requires_grad_()
        name, found = elsewhere(Held(op), [leaf, *tensors[1:]])
        self.assertEqual(found, ([2 * v for v in want], sum(want), gradient))
        return name

    def test_a_pipeline_with_its_buffers_and_schedule(self):
        gradient = [2.0, 6.0, 12.0, 12.0, 10.0, 6.0]
        self.assertEqual(self.check(blur("pickled::blur"), (IMAGE, TAPS), WANT, gradient), "pickled::blur")
        self.assertRegex(self.check(blur(), (IMAGE, TAPS), WANT, gradient), r"^retrograde::\w+$")

    def test_definitions_of_a_module(self):
        op = operator("pickled::of_a_module", torch_held.scaled)
        self.check(op, (IMAGE, torch.tensor(4.0)), [4.0 * v for v in range(6)], [8.0] * 6)

    def test_definitions_inside_of_functions(self):
        power, module = 3, rg

        def define(kind, shapes, more=1):
            image, unused = module.ImageParam(kind, 1, "image"), module.ImageParam(kind, 2, "unused")
            f, at = module.Func("f"), module.Var("at")
            f[at] = module.pow(image[at], power) + more * MARGIN
            return f, [image, unused], lambda image, unused: [int(image.shape[0])]

        op = operator("pickled::inside", define)
        self.check(op, (IMAGE, torch.zeros(1, 1)), [v**3 + 2.0 for v in range(6)], [6.0 * v * v for v in range(6)])

    def test_inputs_that_are_not_read(self):
        image, unused, number, f = (rg.ImageParam("float32", 1, "image"), rg.ImageParam("int32", 2, "unused"),
                                    rg.Param("float32", "number", 2.0), rg.Func("f"))
        f[x] = image[x] + 1
        op = operator("pickled::unread", f, [image, unused, number])
        self.check(op, (IMAGE, torch.zeros(1, 1, dtype=torch.int32), torch.tensor(1.0)), [v + 1.0 for v in range(6)],
                   [2.0] * 6)

    def test_spawned_workers(self):
        context = torch.multiprocessing.get_context("spawn")
        queue = context.SimpleQueue()
        module = Held(blur("pickled::spawned"))
        worker = context.Process(target=torch_held.work, args=(queue, module, (IMAGE, TAPS)))
        worker.start()
        result, gradient = queue.get()
        worker.join()
        self.assertEqual(worker.exitcode, 0)
        self.assertEqual((result.tolist(), gradient), ([2 * v for v in WANT], sum(WANT)))


class Descriptions(unittest.TestCase):
    """Of this process: as if the operator were another process's."""

    def restored(self, op, name):
        from retrograde.torch import _operator
        restore, (_, _, *rest) = op.__reduce__()
        self.assertIs(restore, _operator._restored)
        return restore(*pickle.loads(pickle.dumps((name, "a mark of " + name, *rest))))

    def test_may_be_defined_again_by_who_comes_later(self):
        first = self.restored(blur("pickled::first"), "pickled::again")
        self.assertEqual(first(IMAGE, TAPS).tolist(), WANT)
        self.assertIs(blur("pickled::again"), first)
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x]
        with self.assertRaisesRegex(ValueError, "a name is given once"):
            operator("pickled::again", f, [image])

    def test_of_another_operator_of_the_name(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x]
        other = operator("pickled::other", f, [image])
        with self.assertRaisesRegex(ValueError, r"takes image: torch.float32 and .* one takes image: torch.float32, taps: "):
            self.restored(blur("pickled::blurred"), other.name)

    def test_have_gradients_of_every_order(self):
        image, f = rg.ImageParam("float64", 1, "image"), rg.Func("f")
        f[x] = rg.sin(image[x])
        op = self.restored(operator("pickled::sine", f, [image]), "pickled::sine_again")
        t = torch.rand(5, dtype=torch.float64, requires_grad=True)
        self.assertTrue(torch.autograd.gradcheck(op, (t,)) and torch.autograd.gradgradcheck(op, (t,)))

    def test_hold_no_functions(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = image[x] * 2
        rg.custom_adjoint(f, [image], lambda context: [])
        with self.assertRaisesRegex(rg.Unsupported, 'has derivatives of a user\'s own.*function of a module') as caught:
            pickle.dumps(operator("pickled::custom", f, [image]))
        self.assertTrue(caught.exception.asked and caught.exception.instead)

    def test_of_functions_that_mention_themselves(self):
        def define(kind):
            return define

        from retrograde.torch._pickling import Function
        with self.assertRaisesRegex(rg.CompileError, "it mentions itself.*top of a module"):
            pickle.dumps(Function(define))

    def test_code_of_another_python(self):
        from retrograde.torch._pickling import Function, _function_of_code
        _, parts = Function(lambda image: [image.shape[0] - MARGIN]).__reduce__()
        made = pickle.loads(pickle.dumps(Function(lambda image: [image.shape[0] - MARGIN])))
        self.assertEqual(made.function(torch.zeros(7)), [5])
        with self.assertRaisesRegex(rg.CompileError, "one version of Python"):
            _function_of_code(b"none", *parts[1:])


if __name__ == "__main__":
    unittest.main()
