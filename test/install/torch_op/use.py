"""Tests operators compiled ahead of time from PyTorch, without importing the library.

    use.py FOLDER DRIVER        DRIVER: libretrograde_simt.so"""
import os
import sys
import timeit

import torch
from torch.utils._python_dispatch import TorchDispatchMode

folder, driver = sys.argv[1:]
os.environ.update(RETROGRADE_GPU="simulated", RETROGRADE_SIMT_LIBRARY=driver)
for name in ("weighted", "weighted_on_device", "sum_of_two"):
    torch.ops.load_library(f"{folder}/{name}.so")
weighted, total = torch.ops.tests.weighted, torch.ops.tests.sum_of_two


def raises(kind, words, call):
    try:
        call()
    except kind as error:
        assert words in str(error), error
        return
    raise AssertionError(f"no error: {words}")


image, taps = torch.rand(5, 9, requires_grad=True), torch.tensor([1.0, 2, 1], requires_grad=True)


def theirs(image, taps, gain):
    return gain * sum(image[:, k:k + image.shape[1] - 2] * taps[k] for k in range(3)), image * image


# Values and gradients, with one or both outputs used.
for negative, sign in ((False, 1), (True, -1)):
    ours = weighted(image, taps, 1.5, negative)
    for a, b in zip(ours, theirs(image, taps, 1.5 * sign)):
        assert torch.allclose(a, b)
for loss in (lambda r: r[0].sum(), lambda r: r[1].square().sum(), lambda r: (r[0].square().sum() + r[1].sum())):
    got = torch.autograd.grad(loss(weighted(image, taps, 1.5, False)), (image, taps))
    want = torch.autograd.grad(loss(theirs(image, taps, 1.5)), (image, taps), allow_unused=True)
    for a, b in zip(got, want):
        assert torch.allclose(a, torch.zeros_like(a) if b is None else b, atol=1e-5), (a, b)

# Numbers are differentiated if they are tensors; each gradient is the same alone as together with the others.
gain = torch.tensor(1.5, requires_grad=True)
assert all(torch.equal(a, b) for a, b in zip(weighted(image, taps, gain, True), weighted(image, taps, 1.5, True)))
for given in (image, taps, gain), (gain,), (taps, gain), (image,):
    seeds = [torch.rand(5, 7), torch.rand(5, 9)]
    got = torch.autograd.grad(weighted(image, taps, gain, False), given, seeds)
    want = torch.autograd.grad(theirs(image, taps, gain), given, seeds)
    for a, b in zip(got, want):
        assert a.shape == b.shape and torch.allclose(a, b, rtol=1e-4, atol=1e-5), (a, b)
in_double = torch.tensor(1.5, dtype=torch.float64, requires_grad=True)
alone, = torch.autograd.grad(weighted(image, taps, in_double, False)[0].sum(), in_double)
assert alone.dtype == torch.float64 and abs(alone - theirs(image, taps, 1.0)[0].sum()) < 1e-4

# Only the requested gradients are computed: autograd requests the third one, so no gradient of an image's size exists.
class Asked(TorchDispatchMode):
    wanted = []

    def __torch_dispatch__(self, function, types, args=(), kwargs=None):
        if "weighted_backward" in str(function):
            self.wanted.append(args[-1])
        return function(*args, **(kwargs or {}))


result = weighted(image, taps, gain, False)[0].sum()
with Asked():
    torch.autograd.grad(result, gain)
assert Asked.wanted == [0b100], Asked.wanted
large = torch.rand(100, 100)
with torch.autograd.profiler.profile(profile_memory=True) as seen:
    torch.ops.tests.weighted_backward(large, taps, gain, False, large[:, 2:], large, 0b100)
made = [event.cpu_memory_usage for event in seen.function_events]
assert made and max(made) < 1000, made

# Any strides, empty tensors, shapes without values.
for given in (image.detach()[:, ::2], image.detach().t()[:, :5], torch.ones(1, 1).expand(4, 6), torch.empty(0, 7)):
    for a, b in zip(weighted(given, taps, 2.0, False), theirs(given, taps, 2.0)):
        assert torch.allclose(a, b)
meta = weighted(torch.empty(5, 9, device="meta"), torch.empty(3, device="meta"), 1.0, False)
assert [m.shape for m in meta] == [(5, 7), (5, 9)]

# Errors are exceptions.
raises(RuntimeError, '"image" has 2 dimensions', lambda: weighted(taps, taps, 1.0, False))
raises(RuntimeError, '"image" is a tensor of the CPU of Float over 2 dimensions; given is one of cpu of Double',
       lambda: weighted(image.double(), taps, 1.0, False))
raises(RuntimeError, "cannot", lambda: total(torch.ones(4), torch.ones(3)))
gradient, = torch.autograd.grad(weighted(image, taps, 1.0, False)[0].sum(), image, create_graph=True)
raises(RuntimeError, "no second derivative", lambda: gradient.sum().backward())
raises(RuntimeError, "made without GRADIENT", lambda: total(taps, taps).sum().backward())
raises(RuntimeError, '"gain" is a floating-point number, or a tensor of one without dimensions',
       lambda: weighted(image, taps, torch.ones(1), False))

# Kernels reject memory that the driver does not know; use_wrapper.cpp checks their results.
kernels = torch.ops.tests.weighted_on_device
meta = kernels(torch.empty(5, 9, device="meta"), torch.empty(3, device="meta"), 1.0, False)
assert [m.shape for m in meta] == [(5, 7), (5, 9)]
raises(RuntimeError, "cuPointerGetAttribute", lambda: kernels(image.detach(), taps.detach(), 1.0, False))

if hasattr(torch.library, "opcheck"):
    torch.library.opcheck(weighted.default, (image, taps, 1.5, False))
    torch.library.opcheck(weighted.tensors, (image, taps, gain, False))
    # The backward operator itself has no derivatives.
    given = [t.detach() for t in (image, taps, gain)]
    torch.library.opcheck(torch.ops.tests.weighted_backward.default,
                          (*given, False, torch.ones(5, 7), torch.ones(5, 9), 0b101))
    of_tensors = torch.compile(lambda i, t, g: weighted(i, t, g, False)[0].sin(), fullgraph=True)
    assert torch.allclose(torch.autograd.grad(of_tensors(image, taps, gain).sum(), gain)[0],
                          torch.autograd.grad(weighted(image, taps, gain, False)[0].sin().sum(), gain)[0], atol=1e-5)
    compiled = torch.compile(lambda i, t: weighted(i, t, 1.5, False)[0].sin(), fullgraph=True, dynamic=True)
    for n in (5, 8):
        given = torch.rand(n, 9, requires_grad=True)
        a, b = compiled(given, taps), weighted(given, taps, 1.5, False)[0].sin()
        assert torch.allclose(a, b)
        a.sum().backward()
        assert torch.allclose(given.grad, torch.autograd.grad(b.sum(), given)[0], atol=1e-6)

# Prints the cost of a call; it is not checked, because machines may be busy.
one = torch.ones(1)


def microseconds(call):
    call()
    return 1e6 * min(timeit.repeat(call, number=2000, repeat=5)) / 2000


print(f"PyTorch {torch.__version__}: a call on one element takes {microseconds(lambda: total(one, one)):.2f} us, "
      f"torch.add {microseconds(lambda: torch.ops.aten.add.Tensor(one, one)):.2f} us")
