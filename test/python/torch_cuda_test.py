"""Eight operators (bench/torch/definitions.py) on a GPU, beside the same on the CPU: values, derivatives, streams,
graphs, torch.compile, and what training holds of the device's memory.

    torch_cuda_test.py [--operators NAME,...] [unittest's arguments]

Ends with 77, which ctest counts as skipped, where there is no PyTorch or it finds no GPU."""
import functools
import sys
import unittest
from pathlib import Path

try:
    import torch
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)
if not torch.cuda.is_available():
    print("skipped: PyTorch finds no GPU here")
    sys.exit(77)

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench" / "torch"))
from definitions import OPERATORS
from retrograde.torch import operator
from torch_inputs import inputs_of, values

NAMES = list(OPERATORS)
if "--operators" in sys.argv:
    at = sys.argv.index("--operators")
    NAMES = sys.argv[at + 1].split(",")
    del sys.argv[at:at + 2]
OPS = {name: operator(f"cuda_tests::{name}", OPERATORS[name]) for name in NAMES}
IS_NEW = hasattr(torch.library, "opcheck")


def there(tensors):
    """Images on the device, numbers where they are, each a leaf that wants a gradient."""
    return tuple((t.cuda() if t.dim() else t).detach().requires_grad_() for t in tensors)


def here(tensors):
    return tuple(t.detach().requires_grad_() for t in tensors)


def seed_of(result):
    return values(*result.shape, low=-1, seed=9, kind=result.dtype)


def for_each_operator(test):
    @functools.wraps(test)
    def run(self):
        for name, op in OPS.items():
            with self.subTest(operator=name):
                test(self, name, op)
    return run


class Test(unittest.TestCase):
    def close(self, found, want, tolerance=1e-11):
        self.assertEqual((found.shape, found.dtype), (want.shape, want.dtype))
        scale = max(want.abs().max().item(), 1e-30) if want.numel() else 1
        torch.testing.assert_close(found.cpu() / scale, want / scale, rtol=tolerance, atol=tolerance)


class Values(Test):
    @for_each_operator
    def test_of_both_types(self, name, op):
        for kind, tolerance in ((torch.float64, 1e-11), (torch.float32, 1e-5)):
            result = op(*there(inputs_of(name, kind)))
            self.assertEqual(result.device.type, "cuda")
            self.close(result, op(*inputs_of(name, kind)), tolerance)

    @for_each_operator
    def test_of_strided_expanded_batched_and_empty_tensors(self, name, op):
        first, *rest = inputs_of(name)
        turned = [t.movedim(-1, 0).contiguous().movedim(0, -1) if t.dim() > 1 else t for t in (first, *rest)]
        for tensors in (turned, (torch.stack([first, 0.9 * first + 0.01]), *rest),
                        (first.expand(2, *first.shape), *rest), (first.new_empty(0, *first.shape), *rest)):
            self.close(op(*there(tensors)), op(*tensors))

    @for_each_operator
    def test_numbers_on_the_device(self, name, op):
        tensors = inputs_of(name)
        self.close(op(*(t.cuda() for t in tensors)), op(*tensors))

    @for_each_operator
    def test_on_a_stream(self, name, op):
        """Work on another stream waits for nothing of the current one's, and is ordered among its own."""
        tensors, stream = there(inputs_of(name)), torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            busy = torch.randn(1024, 1024, device="cuda")
            for _ in range(20):
                busy = busy @ busy / 1024
            first = 0.5 * (tensors[0] + busy[0, 0] * 0) + 0.25
            result = op(first, *tensors[1:])
        stream.synchronize()
        self.close(result, op(first.detach().cpu(), *inputs_of(name)[1:]))


class Derivatives(Test):
    @for_each_operator
    def test_gradients(self, name, op):
        for kind, tolerance in ((torch.float64, 1e-11), (torch.float32, 1e-4)):
            ours, theirs = there(inputs_of(name, kind)), here(inputs_of(name, kind))
            want = op(*theirs)
            seed = seed_of(want)
            found = torch.autograd.grad(op(*ours), ours, seed.cuda())
            for a, b in zip(found, torch.autograd.grad(want, theirs, seed)):
                self.close(a, b, tolerance)
            again = torch.autograd.grad(op(*ours), ours, seed.cuda())
            for a, b in zip(found, again):
                self.assertTrue(torch.equal(a, b))

    @for_each_operator
    def test_checked_by_differences(self, name, op):
        tensors = there(inputs_of(name))
        self.assertTrue(torch.autograd.gradcheck(op, tensors, nondet_tol=0.0, fast_mode=True))
        self.assertTrue(torch.autograd.gradgradcheck(op, tensors, nondet_tol=0.0, fast_mode=True))

    @unittest.skipUnless(IS_NEW, f"PyTorch {torch.__version__} has no torch.func")
    @for_each_operator
    def test_tangents(self, name, op):
        first, *rest = inputs_of(name)
        _, want = torch.func.jvp(lambda t: op(t, *rest), (first,), (0.5 * first,))
        moved = [t.detach() for t in there(rest)]
        _, found = torch.func.jvp(lambda t: op(t, *moved), (first.cuda(),), (0.5 * first.cuda(),))
        self.close(found, want)


class Graphs(Test):
    @for_each_operator
    def test_captured_and_replayed(self, name, op):
        """Forward and the gradient by the first image, on whatever the tensors hold then. That by a number is copied
        to the host, which no graph does."""
        first, *rest = (t if t.dim() else t.detach() for t in there(inputs_of(name)))
        seed = seed_of(op(*inputs_of(name))).cuda()
        stream = torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):  # the first run loads the kernels
            for _ in range(2):
                torch.autograd.grad(op(first, *rest), first, seed)
        torch.cuda.current_stream().wait_stream(stream)
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            result = op(first, *rest)
            (gradient,) = torch.autograd.grad(result, first, seed)
        other = (0.9 * inputs_of(name)[0] + 0.01).requires_grad_()
        with torch.no_grad():
            first.copy_(other)
        graph.replay()
        torch.cuda.synchronize()
        want = op(other, *inputs_of(name)[1:])
        self.close(result, want)
        self.close(gradient, torch.autograd.grad(want, other, seed.cpu())[0])


@unittest.skipUnless(IS_NEW, f"PyTorch {torch.__version__} has neither opcheck nor torch.compile")
class TorchLibrary(Test):
    @for_each_operator
    def test_opcheck(self, name, op):
        tensors = there(inputs_of(name))
        torch.library.opcheck(op.overload, tensors)
        seed = seed_of(op(*inputs_of(name))).cuda().requires_grad_()
        torch.library.opcheck(op.derivative, ([*tensors, seed], [0, 1, 1]))

    @for_each_operator
    def test_compiled_as_eager(self, name, op):
        compiled = torch.compile(lambda *tensors, op=op: op(*tensors).square(), fullgraph=True)
        ours, theirs = there(inputs_of(name, torch.float32)), there(inputs_of(name, torch.float32))
        a, b = compiled(*ours), op(*theirs).square()
        torch.testing.assert_close(a, b, rtol=1e-5, atol=1e-5)
        images = [i for i, t in enumerate(ours) if t.dim()]
        found = torch.autograd.grad(a.sum(), [ours[i] for i in images])
        for one, other in zip(found, torch.autograd.grad(b.sum(), [theirs[i] for i in images])):
            torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-5)

    @for_each_operator
    def test_under_autocast(self, name, op):
        tensors = there(inputs_of(name, torch.float32))
        with torch.autocast("cuda"):
            self.close(op(*tensors), op(*inputs_of(name, torch.float32)), 1e-5)


class Training(Test):
    @for_each_operator
    def test_holds_no_more_memory_with_each_step(self, name, op):
        tensors = there(inputs_of(name, torch.float32))
        optimizer = torch.optim.SGD([t for t in tensors if t.dim()], lr=1e-6)

        def train(steps):
            for _ in range(steps):
                optimizer.zero_grad()
                op(*tensors).square().mean().backward()
                optimizer.step()
            torch.cuda.synchronize()
            return torch.cuda.memory_allocated(), torch.cuda.mem_get_info()[0]

        train(20)
        allocated, free = train(20)
        allocated_after, free_after = train(200)
        self.assertEqual(allocated_after, allocated)
        self.assertGreaterEqual(free_after, free - (1 << 20))


class Refusals(Test):
    @for_each_operator
    def test_tensors_of_two_devices(self, name, op):
        first, *rest = inputs_of(name)
        if any(t.dim() for t in rest):
            with self.assertRaisesRegex((TypeError, RuntimeError), "(?i)device"):
                op(first.cuda(), *rest)


if __name__ == "__main__":
    unittest.main()
