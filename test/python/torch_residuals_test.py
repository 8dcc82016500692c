"""Operators of PyTorch whose forward pass hands sums to the gradient. Ends with 77, which ctest counts as skipped, where
there is no PyTorch."""
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
ROWS, COLUMNS = 700, 100


def normalised(kind, shapes):
    """Layer normalisation with scale and shift."""
    image, scale, shift = (rg.ImageParam(kind, n, name) for n, name in ((2, "image"), (1, "scale"), (1, "shift")))
    width = shapes[0][1] if shapes else image.dim(0).extent()
    count = rg.cast(kind, width)
    mean, variance, result, r = rg.Func("mean"), rg.Func("variance"), rg.Func("result"), rg.RDom([(0, width)])
    mean[y] = rg.cast(kind, 0)
    mean[y] += image[r, y] / count
    variance[y] = rg.cast(kind, 0)
    variance[y] += (image[r, y] - mean[y]) * (image[r, y] - mean[y]) / count
    result[x, y] = scale[x] * (image[x, y] - mean[y]) / rg.sqrt(variance[y] + rg.cast(kind, 1e-5)) + shift[x]
    return result, [image, scale, shift]


def reference(image, scale, shift):
    return torch.nn.functional.layer_norm(image, image.shape[-1:], scale, shift)


def tensors(kind=torch.float32, rows=ROWS, columns=COLUMNS):
    generator = torch.Generator().manual_seed(3)
    return tuple(torch.rand(shape, generator=generator, dtype=kind).requires_grad_()
                 for shape in ((rows, columns), (columns,), (columns,)))


class Residuals(unittest.TestCase):
    def setUp(self):
        self.op, self.inputs = operator(f"residuals::{self._testMethodName}", normalised), tensors()
        self.seed = torch.rand(ROWS, COLUMNS, generator=torch.Generator().manual_seed(4))

    def training(self):
        """What the last call kept, by the inputs to differentiate by."""
        return {mask: training for mask, (_, training) in self.op._calls._trainings.items()}

    def assert_close(self, ours, theirs):
        for a, b in zip(ours, theirs, strict=True):
            self.assertEqual(a.shape, b.shape)
            if a.numel():
                self.assertLess((a - b).abs().max().item(), 1e-4 * max(1, b.abs().max().item()))

    def test_gradients_are_right(self):
        theirs = torch.autograd.grad(reference(*self.inputs), self.inputs, self.seed)
        for _ in range(3):
            result = self.op(*self.inputs)
            self.assert_close([result], [reference(*self.inputs)])
            self.assert_close(torch.autograd.grad(result, self.inputs, self.seed), theirs)
        training = self.training()[0b111]
        self.assertEqual(len(training.residuals), 2)
        self.assertEqual([shape for _, shape in training.residual_kinds()], [(ROWS,), (ROWS,)])
        self.assertTrue(training._is_usable)

    def test_results_are_those_of_calls_without_gradient(self):
        with torch.no_grad():
            alone = self.op(*self.inputs)
        self.assert_close([self.op(*self.inputs)], [alone])

    def test_a_retained_graph_runs_backward_again(self):
        result = self.op(*self.inputs)
        first = torch.autograd.grad(result, self.inputs, self.seed, retain_graph=True)
        for a, b in zip(first, torch.autograd.grad(result, self.inputs, self.seed)):
            self.assertTrue(torch.equal(a, b))

    def test_gradients_of_gradients(self):
        def second(function):
            gradient, = torch.autograd.grad(function(*self.inputs), self.inputs[:1], self.seed, create_graph=True)
            return torch.autograd.grad(gradient.square().sum(), self.inputs[:1])

        self.assert_close(second(self.op), second(reference))

    def test_fewer_gradients_than_the_forward_pass_expects(self):
        result = self.op(*self.inputs)
        self.assert_close(torch.autograd.grad(result, self.inputs[1:2], self.seed),
                          torch.autograd.grad(reference(*self.inputs), self.inputs[1:2], self.seed))

    def test_batches_other_sizes_and_types(self):
        for given in (tensors(torch.float64), tensors(rows=10), tensors(columns=400), tensors(rows=0)):
            seed = torch.ones_like(given[0])
            self.assert_close(torch.autograd.grad(self.op(*given), given, seed),
                              torch.autograd.grad(reference(*given), given, seed))
        image = torch.rand(2, ROWS, COLUMNS, requires_grad=True)
        self.assert_close(torch.autograd.grad(self.op(image, *self.inputs[1:]).sum(), [image]),
                          torch.autograd.grad(reference(image, *self.inputs[1:]).sum(), [image]))

    def test_batches_of_gradients(self):
        result = self.op(*self.inputs)
        seeds = torch.stack([self.seed, 2 * self.seed])
        ours, = torch.autograd.grad(result, self.inputs[:1], seeds, is_grads_batched=True)
        theirs, = torch.autograd.grad(reference(*self.inputs), self.inputs[:1], seeds, is_grads_batched=True)
        self.assert_close([ours], [theirs])

    def test_changed_inputs_are_noticed(self):
        result = self.op(*self.inputs)
        with torch.no_grad():
            self.inputs[0].add_(1)
        with self.assertRaisesRegex(RuntimeError, "modified by an inplace operation"):
            torch.autograd.grad(result, self.inputs, self.seed)

    def test_explain_names_them(self):
        self.op(*self.inputs).sum().backward()
        self.assertRegex(self.op.explain(), "kept by the forward pass for the gradient, 5.6 kB: mean, variance")


if __name__ == "__main__":
    unittest.main()
