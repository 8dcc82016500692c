"""Operators of PyTorch: values, gradients of every order, tensors of all kinds. Skipped where there is no PyTorch."""
import re
import textwrap
import threading
import unittest

import retrograde as rg

try:
    import torch
    from retrograde.torch import operator
except ModuleNotFoundError:
    torch = None

x, y = rg.Var("x"), rg.Var("y")


def blur(kind="float64"):
    image, taps, f, k = rg.ImageParam(kind, 1, "image"), rg.ImageParam(kind, 1, "taps"), rg.Func("blur"), rg.RDom([(0, 3)])
    f[x] = rg.cast(kind, 0)
    f[x] += image[x + k] * taps[k]
    return operator(f, [image, taps], sizes=lambda image, taps: [len(image) - 2])


@unittest.skipIf(torch is None, "there is no PyTorch")
class Operators(unittest.TestCase):
    def test_values_and_gradients(self):
        op, image, taps = blur("float32"), torch.rand(8), torch.tensor([1.0, 2, 1], requires_grad=True)
        result = op(image, taps)
        self.assertTrue(torch.allclose(result, image[:-2] + 2 * image[1:-1] + image[2:]))
        result.sum().backward()
        self.assertTrue(torch.allclose(taps.grad, torch.stack([image[n:n + 6].sum() for n in range(3)])))
        self.assertIsNone(image.grad)
        self.assertEqual(set(op._gradients), {(1,)})  # of what was asked for, and nothing else

    def test_the_ten_lines_of_its_documentation(self):
        import retrograde.torch
        program = re.findall(r"^    .*$", retrograde.torch.__doc__, re.M)
        self.assertLessEqual(len(program), 10)
        names = {}
        exec(textwrap.dedent("\n".join(program)), names)
        self.assertEqual(names["weights"].grad.shape, (3,))

    def test_of_every_order(self):
        image = torch.rand(6, dtype=torch.float64, requires_grad=True)
        taps = torch.rand(3, dtype=torch.float64, requires_grad=True)
        self.assertTrue(torch.autograd.gradcheck(blur(), (image, taps), nondet_tol=0.0))
        self.assertTrue(torch.autograd.gradgradcheck(blur(), (image, taps), nondet_tol=0.0))

    def test_params_and_several_outputs(self):
        image, gain = rg.ImageParam("float64", 2, "image"), rg.Param("float64", "gain")
        a, b = rg.Func("a"), rg.Func("b")
        a[x, y] = rg.sin(image[x, y] * gain)
        b[x, y] = image[x, y] * image[x, y] * gain
        op = operator([a, b], [image, gain])
        pixels = torch.rand(3, 4, dtype=torch.float64, requires_grad=True)
        value = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
        first, second = op(pixels, value)
        self.assertTrue(torch.allclose(first, torch.sin(1.5 * pixels)) and torch.allclose(second, 1.5 * pixels**2))
        self.assertTrue(torch.autograd.gradcheck(op, (pixels, value), nondet_tol=0.0))
        self.assertTrue(torch.autograd.gradgradcheck(op, (pixels, value), nondet_tol=0.0))
        first, _ = op(pixels, 1.5)  # a number; and one output that nobody uses
        first.sum().backward()
        self.assertTrue(torch.allclose(pixels.grad, 1.5 * torch.cos(1.5 * pixels)))

    def test_any_strides(self):
        image, f = rg.ImageParam("float32", 2, "image"), rg.Func("f")
        f[x, y] = image[x, y] + 100 * rg.f32(y)
        op, t = operator(f, [image]), torch.arange(24.0).reshape(4, 6)
        want = lambda t: t + 100 * torch.arange(float(t.shape[0]))[:, None]
        for given in (t, t.T, t[::2, 1::2], torch.ones(1, 1).expand(3, 5), torch.empty(0, 3)):
            self.assertTrue(torch.equal(op(given), want(given)))
        given = torch.ones(1, requires_grad=True)
        op(given.expand(3, 5)).sum().backward()
        self.assertEqual(given.grad.item(), 15)

    def test_types(self):
        for kind in (torch.uint8, torch.int8, torch.int16, torch.int32, torch.int64, torch.float16, torch.bfloat16):
            from retrograde.torch import DTYPES
            image, f = rg.ImageParam(DTYPES[kind], 1, "image"), rg.Func("f")
            f[x] = image[x] + rg.cast(DTYPES[kind], 1)
            self.assertTrue(torch.equal(operator(f, [image])(torch.arange(5).to(kind)), torch.arange(1, 6).to(kind)))
        image, f = rg.ImageParam(rg.Bool(), 1, "image"), rg.Func("f")
        f[x] = ~image[x]
        self.assertEqual(operator(f, [image])(torch.tensor([True, False])).tolist(), [False, True])

    def test_refusals(self):
        op = blur("float32")
        for given, words in (((torch.rand(8),), "takes image, taps"), ((torch.rand(8), [1, 2, 1]), "taps is a tensor"),
                             ((torch.rand(8).double(), torch.rand(3)), "holds float32"),
                             ((torch.rand(2, 8), torch.rand(3)), "over 1 dimensions")):
            with self.assertRaisesRegex(TypeError, words):
                op(*given)
        with self.assertRaises(rg.RuntimeError):
            blur("float32")(torch.rand(8), torch.rand(2))
        f = rg.Func("f")
        f[x] = (x, x)
        with self.assertRaisesRegex(rg.CompileError, "one value at each point"):
            operator(f, [])

    def test_many_threads(self):
        op, failures = blur("float32"), []

        def work(seed):
            image, taps = torch.full((20,), float(seed)), torch.ones(3, requires_grad=True)
            for _ in range(5):
                taps.grad = None
                op(image, taps).sum().backward()
                if taps.grad.tolist() != [18.0 * seed] * 3:
                    failures.append(seed)

        threads = [threading.Thread(target=work, args=(n,)) for n in range(8)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(failures, [])


if __name__ == "__main__":
    unittest.main()
