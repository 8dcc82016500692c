"""Definitions of PyTorch operators: who gives the sizes of results and as what, what is refused, and numbers for
Params. Ends with 77, which ctest counts as skipped, where there is no PyTorch."""
import copy
import pickle
import sys
import unittest

import retrograde as rg

try:
    import torch
    from retrograde.torch import operator
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

x, y = rg.Var("x"), rg.Var("y")
CAN_COMPILE = hasattr(torch, "compile")


def correlation(kind, shapes):
    """Each row of an image with taps; the sizes of the result are numbers for known shapes, and expressions for None."""
    image, taps, f = rg.ImageParam(kind, 2, "image"), rg.ImageParam(kind, 1, "taps"), rg.Func("correlation")
    n, width, height = (shapes[1][0], *reversed(shapes[0])) if shapes else \
        (taps.dim(0).extent(), image.dim(0).extent(), image.dim(1).extent())
    r = rg.RDom([(0, n)])
    f[x, y] += image[x + r, y] * taps[r]
    return f, [image, taps], [width - n + 1, height]


def without_sizes(kind, shapes):
    return correlation(kind, shapes)[:2]


def want(image, taps):
    return torch.nn.functional.conv1d(image[:, None], taps[None, None])[:, 0]


def given(rows, columns, n=3):
    return torch.rand(rows, columns, requires_grad=True), torch.rand(n, requires_grad=True)


OP = operator("definitions::correlation", correlation)


class Expressions(unittest.TestCase):
    def check(self, op, image, taps):
        ours, theirs = op(image, taps), want(image, taps)
        torch.testing.assert_close(ours, theirs)
        got = torch.autograd.grad(ours.square().sum(), (image, taps))
        for a, b in zip(got, torch.autograd.grad(theirs.square().sum(), (image, taps))):
            torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-4)

    def test_for_more_shapes_than_are_compiled_separately(self):
        for n in range(10):
            self.check(OP, *given(2 + n, 9 + n))

    def test_for_tensors_without_elements(self):
        self.assertEqual(OP(*given(0, 20)).shape, (0, 18))

    @unittest.skipUnless(CAN_COMPILE, "this PyTorch has no torch.compile")
    def test_under_torch_compile(self):
        for dynamic in (False, True):
            compiled = torch.compile(lambda image, taps: OP(image.relu(), taps) * 2, fullgraph=True,
                                     backend="aot_eager", dynamic=dynamic)
            for columns in (12, 13):
                image, taps = given(3, columns)
                result = compiled(image, taps)
                torch.testing.assert_close(result, 2 * want(image, taps))
                result.sum().backward()
                self.assertEqual(image.grad.shape, image.shape)

    def test_of_many_kinds(self):
        image, count, f = rg.ImageParam("float32", 1, "image"), rg.Param("int32", "count"), rg.Func("f")
        f[x] = image[x]
        n = image.dim(0).extent()
        for size, sizes in ((n // 2 + 1, (3, 4)), (rg.max(n - 5, 1), (1, 2)), (n % 3, (1, 1)), (-(-n // 2), (2, 4)),
                            (rg.select(n > 4, 4, n), (4, 4)), (rg.i32(rg.ceil(n * 0.4)), (2, 3)), ((n - 1) >> 1, (1, 3)),
                            (rg.clamp(n, 2, 5), (4, 5)), (count + 1, (3, 3)), (count, (2, 2))):
            op = operator(f, [image, count], [size])
            self.assertEqual(tuple(len(op(torch.rand(m), 2)) for m in (4, 7)), sizes)
        with self.assertRaisesRegex(rg.Unsupported, "sizes of its images.*elsewhere"):
            operator(f, [image, count], [rg.ImageParam("float32", 1, "elsewhere").dim(0).extent()])(torch.rand(3), 1)

    def test_take_shapes_if_they_can(self):
        def made(kind, shapes, factor=1):
            given_shapes.append(shapes)
            return without_sizes(kind, shapes)

        sizes = lambda image, taps: [image.shape[1] - taps.shape[0] + 1, image.shape[0]]
        for i, (define, takes) in enumerate((
                (lambda *both: made(*both), True), (lambda kind, *rest: made(kind, *rest), True),
                (lambda kind, shapes=None: made(kind, shapes), True), (lambda kind: made(kind, None), False),
                (lambda kind, factor=2: made(kind, None, factor), False), (lambda kind, *, n=2: made(kind, None), False))):
            given_shapes = []
            image, taps = given(4, 20)
            op = operator(f"definitions::takes_{i}", define, sizes=sizes)
            torch.testing.assert_close(op(image, taps), want(image, taps))
            self.assertEqual(((4, 20), (3,)) in [tuple(map(tuple, s)) for s in given_shapes if s], takes)

    def test_sizes_that_are_none(self):
        halves = operator("definitions::halves", lambda kind, shapes: (
            *without_sizes(kind, shapes), [shapes[0][1] / 2, 1] if shapes else [1, 1]))
        with self.assertRaisesRegex(ValueError, r"a size is an integer; 4.0 is a float.*image \[1, 8\].*with //"):
            halves(torch.rand(1, 8), torch.rand(3))
        with self.assertRaisesRegex(ValueError, r"not negative; one is -1, .*image \[4, 1\], taps \[3\]"):
            operator("definitions::negative", correlation)(torch.rand(4, 1), torch.rand(3))


class SizesBesideAFunction(unittest.TestCase):
    """operator(name, define, sizes=...): the definition leaves the sizes to the argument."""

    def test_are_used(self):
        image, taps = given(4, 20)
        for i, word in enumerate(("outputs", "sizes")):
            op = operator(f"definitions::{word}", without_sizes, **{
                word: lambda image, taps: [image.shape[1] - taps.shape[0] + 1, image.shape[0]]})
            torch.testing.assert_close(op(image, taps), want(image, taps))
            self.assertIs(pickle.loads(pickle.dumps(op)), op)
            self.assertIs(copy.deepcopy(op), op)

    def test_are_given_once(self):
        with self.assertRaisesRegex(TypeError, "given once.*Leave out one"):
            operator("definitions::both", correlation, sizes=[1, 2])
        with self.assertRaisesRegex(TypeError, "returns its inputs.*Leave them out"):
            operator("definitions::inputs", correlation, [rg.ImageParam("float32", 1, "image")])


class Refusals(unittest.TestCase):
    def test_results_that_are_no_funcs(self):
        image = rg.ImageParam("float32", 1, "image")
        for pipeline, inputs in ((lambda kind, shapes: (image, [image], [8]), None), (image, [image]),
                                 ([image], [image])):
            with self.assertRaisesRegex(TypeError, 'a result is a Func; one is the ImageParam "image".*f.x. = image'):
                operator("definitions::image", pipeline, inputs)
        with self.assertRaisesRegex(TypeError, r"returns \(pipeline, inputs\).*type Func"):
            operator("definitions::alone", lambda kind, shapes: correlation(kind, shapes)[0])

    def test_errors_of_a_definition_are_its_own(self):
        def define(kind, shapes):
            image, f = rg.ImageParam(kind, 1, "image"), rg.Func("f")
            f[x] = 2 * image
            return f, [image]

        with self.assertRaisesRegex(TypeError, r"^unsupported operand type.*ImageParam"):
            operator("definitions::whole", define)

    def test_reads_outside_of_a_tensor(self):
        def define(kind, shapes):
            image, f = rg.ImageParam(kind, 2, "image"), rg.Func("f")
            f[x, y] = image[x + 1, y] - image[x, y]
            return f, [image]

        words = r'"image" has 8 elements along dimension 0 \(axis 1 of the tensor\), and index 8 is read.*smaller.*rg\.Bound'
        with self.assertRaisesRegex(rg.RuntimeError, words) as caught:
            operator("definitions::outside", define)(torch.rand(5, 8))
        self.assertNotIn("promise", str(caught.exception))
        self.assertNotEqual(caught.exception.code, 0)

    def test_functions_of_tensors(self):
        image = rg.ImageParam("float32", 1, "image")
        with self.assertRaisesRegex(TypeError, r"torch.exp to an expression.*rg\.exp"):
            torch.exp(image[x])
        for use in (lambda t, e: t * e, lambda t, e: e * t, lambda t, e: t < e):
            with self.assertRaisesRegex(rg.CompileError, r"a tensor and an expression.*ImageParam.*rg\.Buffer\(t\)"):
                use(torch.tensor(2.0), image[x])


class Numbers(unittest.TestCase):
    """A Param takes what PyTorch takes for a number."""

    def test_integers(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        gain, shift = rg.Param("float32", "gain"), rg.Param("int32", "shift")
        f[x] = image[x] * gain + shift
        op, ones = operator(f, [image, gain, shift]), torch.ones(1)
        for a in (2, 2.0, torch.tensor(2), torch.tensor(2, dtype=torch.uint8), torch.tensor(2.0)):
            for b in (3, torch.tensor(3), torch.tensor(3, dtype=torch.int32)):
                self.assertEqual(op(ones, a, b).tolist(), [5])
        for b in (torch.tensor(2**40), torch.tensor(2.5), 2.5):
            with self.assertRaisesRegex(TypeError, "shift: int32|shift is an integer"):
                op(ones, 1, b)
        if CAN_COMPILE:
            compiled = torch.compile(lambda t, a: op(t, a, 3), fullgraph=True, backend="aot_eager")
            self.assertEqual(compiled(ones, torch.tensor(2)).tolist(), [5])

    def test_in_the_type_of_the_call(self):
        def define(kind):
            image, gain, f = rg.ImageParam(kind, 1, "image"), rg.Param(kind, "gain"), rg.Func("f")
            f[x] = image[x] * gain
            return f, [image, gain]

        op = operator("definitions::gain", define)
        for kind in (torch.float32, torch.float64):
            for gain in (2, torch.tensor(2)):
                self.assertEqual(op(torch.ones(1, dtype=kind), gain).dtype, kind)


if __name__ == "__main__":
    unittest.main()
