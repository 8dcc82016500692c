"""Eight operators (bench/torch/definitions.py) as PyTorch sees them: derivatives of both modes and orders, what opcheck
checks, tensors of all kinds, torch.compile, vmap, and that training with them leaks nothing.

    torch_operators_test.py OPERATOR [unittest's arguments]

Ends with 77, which ctest counts as skipped, where there is no PyTorch."""
import ctypes
import gc
import os
import resource
import sys
import unittest
from pathlib import Path

try:
    import torch
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench" / "torch"))
from definitions import OPERATORS
from formulations import FORMULATIONS
from retrograde.torch import operator
from torch_inputs import inputs_of, inputs_of_sizes, sizes_of, values

NAME = sys.argv.pop(1)
STEPS = int(os.environ.get("RETROGRADE_TORCH_STEPS", 1000))
OP = operator(f"tests::{NAME}", OPERATORS[NAME])  # compiled for each set of sizes
OF_ANY_SIZES = operator(f"tests::{NAME}_of_any_sizes", lambda kind: OPERATORS[NAME](kind))
IS_NEW = hasattr(torch.library, "opcheck")


def inputs(kind=torch.float64):
    return inputs_of(NAME, kind)


def wanting(tensors):
    return tuple(t.detach().requires_grad_() for t in tensors)


def strided(t):
    """The same values, every second of a larger tensor's, its axes in reverse, not from its start."""
    if t.dim() == 0:
        return t
    wide = torch.full([2 * n + 1 for n in reversed(t.shape)], float("nan"), dtype=t.dtype)
    view = wide[tuple(slice(1, None, 2) for _ in t.shape)].permute(*reversed(range(t.dim())))
    view.copy_(t)
    return view


def layouts_of(tensors):
    """The same sizes in memory of all kinds: dense, axes in reverse, and, for each axis, one element for all of it, as
    expand() makes it; and what extents of 1 have for strides then."""
    yield "dense", tensors
    yield "transposed", [t.permute(list(reversed(range(t.dim())))).contiguous().permute(list(reversed(range(t.dim()))))
                         for t in tensors]
    for axis in range(1, max(t.dim() for t in tensors) + 1):
        yield f"axis -{axis} expanded", [t.narrow(-axis, 0, min(1, t.shape[-axis])).expand(t.shape)
                                         if t.dim() >= axis and t.shape[-axis] else t for t in tensors]
    yield "any strides", [torch.as_strided(t.contiguous(), t.shape, [
        stride if size > 1 else 7 * i for i, (size, stride) in enumerate(zip(t.shape, t.contiguous().stride()))])
        if t.numel() else t for t in tensors]


def reference(tensors):
    """The formulation, or what it would give of no elements, of which PyTorch's own operators know little."""
    if all(t.numel() for t in tensors):
        return FORMULATIONS[NAME](*tensors)
    result = OP(*[t.detach() for t in tensors])
    return torch.zeros_like(result) + sum(0 * t.sum() for t in tensors)


class Sizes(unittest.TestCase):
    """0, 1 and 2 in each dimension, in memory of all kinds; the seeds of sums are expanded as well."""

    def cases(self):
        for sizes in sizes_of(NAME):
            # Code for all sizes has reduction domains of at least one element, which begin at 1.
            has_domains = NAME != "recursive_filter" or 1 not in sizes.values()
            if has_domains:
                yield OF_ANY_SIZES, sizes
            if set(sizes.values()) == {1} or not has_domains:
                yield OP, sizes

    def test_values_and_gradients(self):
        for op, sizes in self.cases():
            for layout, tensors in layouts_of(inputs_of_sizes(NAME, sizes)):
                with self.subTest(op=op.name, sizes=sizes, layout=layout):
                    ours, theirs = wanting(tensors), wanting(tensors)
                    for mine, tensor in zip(ours, tensors):
                        self.assertEqual(mine.stride(), tensor.stride())
                    result, want = op(*ours), reference(theirs)
                    torch.testing.assert_close(result, want, rtol=1e-11, atol=1e-13)
                    result.sum().backward()
                    want.sum().backward()
                    for a, b in zip(ours, theirs):
                        torch.testing.assert_close(a.grad, b.grad, rtol=1e-10, atol=1e-12)

    def test_seeds_of_any_strides(self):
        for op, sizes in self.cases():
            ours = wanting(inputs_of_sizes(NAME, sizes))
            result = op(*ours)
            if not result.numel():
                continue
            want = torch.autograd.grad(result, ours, torch.ones_like(result), retain_graph=True)
            for seed in (torch.ones((), dtype=result.dtype).expand(result.shape),
                         torch.ones([1] * result.dim(), dtype=result.dtype).expand(result.shape),
                         strided(torch.ones_like(result))):
                with self.subTest(op=op.name, sizes=sizes, strides=seed.stride()):
                    got = torch.autograd.grad(result, ours, seed, retain_graph=True)
                    for a, b in zip(got, want):
                        self.assertTrue(torch.equal(a, b))


class Mapped(unittest.TestCase):
    """Autograd's own vmap: over gradients, and over vectors in jacobian and hessian."""

    def test_batched_gradients(self):
        tensors = wanting(inputs())
        shared = wanting([torch.stack([tensors[0]] * 2).detach(), *tensors[1:]])  # the others are each item's
        for given in (tensors, shared):
            result = OP(*given)
            seeds = values(3, *result.shape, low=-1)
            got = torch.autograd.grad(result, given, seeds, is_grads_batched=True, retain_graph=True)
            each = [torch.autograd.grad(result, given, seed, retain_graph=True) for seed in seeds]
            for all_items, *items in zip(got, *each):
                torch.testing.assert_close(all_items, torch.stack(items), rtol=1e-13, atol=1e-15)

    def test_batched_gradients_are_differentiated_again(self):
        tensors = wanting(inputs())
        result = OP(*tensors)
        seeds = values(2, *result.shape, low=-1)
        got = torch.autograd.grad(result, tensors, seeds, is_grads_batched=True, create_graph=True)
        each = [torch.autograd.grad(result, tensors, seed, create_graph=True) for seed in seeds]
        second = [torch.autograd.grad(sum(t.square().sum() for t in gradients), tensors, retain_graph=True)
                  for gradients in (got, [t for one in each for t in one])]
        for a, b in zip(*second):
            torch.testing.assert_close(a, b, rtol=1e-11, atol=1e-13)

    def test_jacobians(self):
        functional, tensors = torch.autograd.functional, tuple(inputs())
        want = functional.jacobian(OP, tensors)
        for strategy in ("reverse-mode", "forward-mode"):
            got = functional.jacobian(OP, tensors, vectorize=True, strategy=strategy)
            for a, b in zip(got, want):
                torch.testing.assert_close(a, b, rtol=1e-11, atol=1e-13)

    def test_hessians(self):
        functional, first, rest = torch.autograd.functional, inputs()[0], inputs()[1:]
        if first.numel() > 16:
            self.skipTest("a Hessian of more than 16 elements takes long")

        def loss(t):
            return OP(t, *rest).square().sum()
        want = functional.hessian(loss, first)
        for strategy in ("reverse-mode", "forward-mode"):
            got = functional.hessian(loss, first, vectorize=True, outer_jacobian_strategy=strategy)
            torch.testing.assert_close(got, want, rtol=1e-10, atol=1e-12)


class Values(unittest.TestCase):
    def check(self, tensors, close=1e-12):
        result, want = OP(*tensors), FORMULATIONS[NAME](*tensors)
        self.assertEqual((result.shape, result.dtype), (want.shape, want.dtype))
        self.assertLessEqual((result - want).abs().max().item(), close * want.abs().max().item())

    def test_of_both_types(self):
        self.check(inputs())
        self.check(inputs(torch.float32), close=2e-5)

    def test_gradients_are_those_of_the_formulation(self):
        ours, theirs = wanting(inputs()), wanting(inputs())
        result, want = OP(*ours), FORMULATIONS[NAME](*theirs)
        seed = values(*result.shape, low=-1, seed=3)
        result.backward(seed)
        want.backward(seed)
        for a, b in zip(ours, theirs):
            self.assertLessEqual((a.grad - b.grad).abs().max().item(), 1e-11 * b.grad.abs().max().item())

    def test_tensors_of_any_strides(self):
        want = OP(*inputs())
        torch.testing.assert_close(OP(*(strided(t) for t in inputs())), want, rtol=0, atol=1e-14)
        first, *rest = inputs()
        expanded = first[..., :1].expand(first.shape) if first.dim() else first
        torch.testing.assert_close(OP(expanded, *rest), OP(expanded.contiguous(), *rest), rtol=0, atol=1e-14)

    def test_a_batch(self):
        """The first tensor has one for each item, the others are shared."""
        first, *rest = wanting(inputs())
        batch = torch.stack([first, 0.9 * first + 0.01, first]).detach().requires_grad_()
        result = OP(batch, *rest)
        for one, item in zip(result, batch):
            torch.testing.assert_close(one, OP(item, *rest), rtol=0, atol=0)
        gradients = torch.autograd.grad(result.square().sum(), (batch, *rest))
        singles = [torch.autograd.grad(OP(item, *rest).square().sum(), (item, *rest))
                   for item in [b.detach().requires_grad_() for b in batch]]
        torch.testing.assert_close(gradients[0], torch.stack([s[0] for s in singles]), rtol=0, atol=0)
        for i in range(len(rest)):
            torch.testing.assert_close(gradients[i + 1], sum(s[i + 1] for s in singles), rtol=1e-13, atol=1e-15)

    def test_an_empty_batch(self):
        first, *rest = inputs()
        empty = first.new_empty(0, *first.shape).requires_grad_()
        rest = wanting(rest)
        result = OP(empty, *rest)
        self.assertEqual(result.shape, (0, *OP(first, *rest).shape))
        gradients = torch.autograd.grad(result.sum(), (empty, *rest))
        self.assertEqual(gradients[0].shape, empty.shape)
        for gradient, tensor in zip(gradients[1:], rest):
            self.assertTrue(torch.equal(gradient, torch.zeros_like(tensor)))

    def test_a_tensor_without_elements(self):
        """Of the first dimension, which is outermost and no count that the operator wants to be more than 0."""
        first, *rest = inputs()
        shape = (0, *first.shape[1:]) if NAME in ("convolution", "spatial_transformer") else (*first.shape[:-1], 0)
        if NAME == "spatial_transformer":
            rest = [rest[0][:0]]
        if NAME in ("bilateral_slice", "flow_warp"):
            rest[0] = rest[0][..., :0]
        empty, rest = first.new_empty(shape).requires_grad_(), wanting(rest)
        result = OP(empty, *rest)
        if NAME == "soft_histogram":
            self.assertTrue(torch.equal(result, torch.zeros_like(result)))
        else:
            self.assertEqual(result.numel(), 0)
        for gradient, tensor in zip(torch.autograd.grad(result.sum(), (empty, *rest)), (empty, *rest)):
            self.assertTrue(torch.equal(gradient, torch.zeros_like(tensor)))


class Derivatives(unittest.TestCase):
    def test_first(self):
        self.assertTrue(torch.autograd.gradcheck(OP, wanting(inputs()), nondet_tol=0.0, check_forward_ad=True))

    def test_second(self):
        self.assertTrue(torch.autograd.gradgradcheck(OP, wanting(inputs()), nondet_tol=0.0))

    def test_of_strided_expanded_and_batched_tensors(self):
        first, *rest = inputs()
        shared = torch.stack([first, first]).detach()
        for given in ([strided(t) for t in (first, *rest)], [first[..., :1], *rest], [shared, *rest]):
            def call(first_given, *others):
                return OP(first_given.expand(*first_given.shape[:-1], inputs()[0].shape[-1]), *others)
            with self.subTest(shapes=[t.shape for t in given]):
                self.assertTrue(torch.autograd.gradcheck(call, wanting(given), nondet_tol=0.0, fast_mode=True))


@unittest.skipUnless(IS_NEW, f"PyTorch {torch.__version__} has neither opcheck nor torch.compile")
class TorchLibrary(unittest.TestCase):
    def test_opcheck(self):
        tensors = wanting(inputs())
        torch.library.opcheck(OP.overload, tensors)
        seed = torch.ones_like(OP(*tensors)).requires_grad_()
        wanted = 2**len(tensors) - 1
        torch.library.opcheck(OP.derivative, ([*tensors, seed], [0, wanted, 1]))
        torch.library.opcheck(OP.derivative, ([*tensors, tensors[0]], [1, 1, 0]))

    def test_vmap_is_a_loop(self):
        first, *rest = inputs()
        batch = torch.stack([first, 0.9 * first + 0.01], -1)
        of_last = (batch.dim() - 1, *[None] * len(rest))
        want = torch.stack([OP(batch[..., i].contiguous(), *rest) for i in range(2)])
        self.assertTrue(torch.equal(torch.vmap(OP, of_last)(batch, *rest), want))

        def loss(*tensors):
            return OP(*tensors).square().sum()

        by = tuple(range(1 + len(rest)))
        got = torch.vmap(torch.func.grad(loss, by), of_last)(batch, *rest)
        each = [torch.func.grad(loss, by)(batch[..., i].contiguous(), *rest) for i in range(2)]
        for all_items, *items in zip(got, *each):
            torch.testing.assert_close(all_items, torch.stack(items), rtol=0, atol=0)

    def test_compiled_as_eager(self):
        compiled = torch.compile(lambda *tensors: OP(*tensors).square(), fullgraph=True, dynamic=True)
        for more in range(3):
            tensors = inputs(torch.float32)
            if NAME != "bilateral_slice":
                tensors = (torch.cat([tensors[0]] * (more + 1), -1), *tensors[1:])
            if NAME == "flow_warp":
                tensors = (tensors[0], torch.cat([tensors[1]] * (more + 1), -1))
            ours, theirs = wanting(tensors), wanting(tensors)
            a, b = compiled(*ours), OP(*theirs).square()
            torch.testing.assert_close(a, b, rtol=1e-6, atol=1e-6)
            a.sum().backward()
            b.sum().backward()
            for one, other in zip(ours, theirs):
                torch.testing.assert_close(one.grad, other.grad, rtol=1e-5, atol=1e-6)


class Training(unittest.TestCase):
    def test_leaks_nothing(self):
        tensors = wanting(inputs(torch.float32))
        optimizer = torch.optim.SGD(tensors, lr=1e-6)

        def train(steps):
            for _ in range(steps):
                optimizer.zero_grad()
                OP(*tensors).square().mean().backward()
                optimizer.step()
            gc.collect()
            objects = gc.get_objects()
            return len(objects), sum(isinstance(one, torch.Tensor) for one in objects), heap_bytes(), resident_kb()

        train(50)
        objects, live, heap, kb = train(STEPS // 2)
        objects_after, live_after, heap_after, kb_after = train(STEPS // 2)
        self.assertLessEqual(objects_after - objects, 10)
        self.assertEqual(live_after, live)
        self.assertLessEqual(heap_after - heap, 8 * STEPS)  # less than any object takes
        self.assertLessEqual(kb_after - kb, 1024)


def heap_bytes():
    """What of the C library's memory is in use: tensors' elements, and what the compiled code and the extension hold."""
    class Mallinfo(ctypes.Structure):
        _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks",
                                                         "fsmblks", "uordblks", "fordblks", "keepcost")]
    mallinfo2 = ctypes.CDLL("libc.so.6").mallinfo2
    mallinfo2.restype = Mallinfo
    info = mallinfo2()
    return info.uordblks + info.hblkhd


def resident_kb():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 1024


if __name__ == "__main__":
    unittest.main()
