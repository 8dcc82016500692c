"""Operators of PyTorch: values, gradients of every order, tensors of all kinds. Ends with 77,
which ctest counts as skipped, where there is no PyTorch."""
import os
import re
import sys
import textwrap
import threading
import unittest
from unittest import mock

import retrograde as rg

try:
    import torch
    from retrograde.torch import operator
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

x, y = rg.Var("x"), rg.Var("y")


def blur(kind="float64"):
    image, taps, f, k = rg.ImageParam(kind, 1, "image"), rg.ImageParam(kind, 1, "taps"), rg.Func("blur"), rg.RDom([(0, 3)])
    f[x] = rg.cast(kind, 0)
    f[x] += image[x + k] * taps[k]
    return operator(f, [image, taps], sizes=lambda image, taps: [len(image) - 2])


class Operators(unittest.TestCase):
    def test_values_and_gradients(self):
        op, image, taps = blur("float32"), torch.rand(8), torch.tensor([1.0, 2, 1], requires_grad=True)
        result = op(image, taps)
        self.assertTrue(torch.allclose(result, image[:-2] + 2 * image[1:-1] + image[2:]))
        result.sum().backward()
        self.assertTrue(torch.allclose(taps.grad, torch.stack([image[n:n + 6].sum() for n in range(3)])))
        self.assertIsNone(image.grad)
        self.assertEqual(op.made(), [(0, 0b10, 0b1)])  # of what was asked for, and nothing else

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
        self.assertTrue(torch.autograd.gradgradcheck(lambda t: op(t, 1.5)[0], (pixels,), nondet_tol=0.0))
        first, _ = op(pixels, 1.5)  # a number; and one output that nobody uses
        first.sum().backward()
        self.assertTrue(torch.allclose(pixels.grad, 1.5 * torch.cos(1.5 * pixels)))

    def test_any_strides(self):
        image, f = rg.ImageParam("float32", 2, "image"), rg.Func("f")
        f[x, y] = image[x, y] + 100 * rg.f32(y)
        op, t = operator(f, [image]), torch.arange(24.0).reshape(4, 6)
        want = lambda t: t + 100 * torch.arange(float(t.shape[0]))[:, None]
        for given in (t, t.T, t[::2, 1::2], torch.ones(1, 1).expand(3, 5), torch.empty(0, 3), t[:, 1:4]):
            self.assertTrue(torch.equal(op(given), want(given)))
        given = torch.ones(1, requires_grad=True)
        op(given.expand(3, 5)).sum().backward()
        self.assertEqual(given.grad.item(), 15)

    def test_any_strides_of_points(self):
        def define(kind, shapes):
            m, p, f = rg.ImageParam(kind, 2, "m"), rg.ImageParam(kind, 2, "p"), rg.Func("f")
            r = rg.RDom([(0, 3)])
            f[x, y] = 0.0
            f[x, y] += m[r, x] * p[r, y]
            return f, [m, p], [3, shapes[1][0] if shapes else p.dim(1).extent()]

        op = operator(define)
        wide = torch.arange(500.0).reshape(100, 5)
        for given in (wide[:, :3].clone(), wide[:, 1:4], wide[:, :3].T.contiguous().T, wide[:, :3].clone()):
            given, matrix = given.detach().requires_grad_(), torch.arange(9.0).reshape(3, 3).requires_grad_()
            moved = op(matrix, given)
            self.assertTrue(torch.equal(moved, given @ matrix.T))
            (moved * moved).sum().backward()
            ours = [t.grad for t in (matrix, given)]
            matrix.grad = given.grad = None
            ((given @ matrix.T)**2).sum().backward()
            for found, exact in zip(ours, (matrix.grad, given.grad)):
                self.assertTrue(torch.allclose(found, exact, rtol=1e-5))

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
                             ((torch.rand(8).double(), torch.rand(3)), r"given are image: float64 \[8\]"),
                             ((torch.tensor(1.0), torch.rand(3)), "image: float32 over 1 dimensions"),
                             ((torch.rand(2, 8), torch.rand(3, 3)), r"image \[2, 8\], taps \[3, 3\]")):
            with self.assertRaisesRegex(TypeError, words) as caught:
                op(*given)
            self.assertTrue(caught.exception.asked and caught.exception.instead)
        with self.assertRaises(rg.RuntimeError):
            blur("float32")(torch.rand(8), torch.rand(2))
        f = rg.Func("f")
        f[x] = (x, x)
        with self.assertRaisesRegex(rg.CompileError, "one value at each point"):
            operator(f, [], [3])
        f = rg.Func("f")
        f[x] = x
        with self.assertRaisesRegex(rg.CompileError, "Give `outputs`"):
            operator(f, [])
        f = rg.Func("f")
        f[x] = rg.u16(x)
        with self.assertRaisesRegex(rg.CompileError, "those of a tensor"):
            operator(f, [], [3])
        with self.assertRaisesRegex(ValueError, "namespace::name"):
            operator("nothing", f, [], [3])

    def test_a_name_of_its_own(self):
        image, f = rg.ImageParam("float32", 1, "image"), rg.Func("f")
        f[x] = 2 * image[x]
        operator("tests::twice", f, [image])
        self.assertEqual(torch.ops.tests.twice(torch.ones(2)).tolist(), [2, 2])
        self.assertIn("tests::twice(Tensor image) -> Tensor", str(torch.ops.tests.twice.default._schema))
        with self.assertRaisesRegex(ValueError, "a name is given once"):
            operator("tests::twice", f, [image])

    def test_one_definition_for_each_type(self):
        asked = []

        def define(kind, shapes):
            asked.append((kind, shapes))
            image, f = rg.ImageParam(kind, 1, "image"), rg.Func("f")
            f[x] = image[x] * image[x]
            return f, [image]

        op = operator("tests::square", define)
        for kind in (torch.float32, torch.float64):
            for n in (3, 4, 3):
                t = torch.rand(n, dtype=kind, requires_grad=True)
                result = op(t)
                self.assertEqual(result.dtype, kind)
                self.assertTrue(torch.equal(result, t * t))
                result.sum().backward()
                self.assertTrue(torch.equal(t.grad, 2 * t))
        self.assertEqual(asked, [("float32", None), ("float32", [(3,)]), ("float32", [(4,)]), ("float64", None),
                                 ("float64", [(3,)]), ("float64", [(4,)])])
        with self.assertRaisesRegex(TypeError, "given are image: int32"):
            op(torch.arange(3, dtype=torch.int32))
        for n in range(5, 20):  # more sizes than are compiled for themselves
            self.assertEqual(op(torch.full((n,), 3.0)).tolist(), [9] * n)
        self.assertLess(len(asked), 20)

    def test_sizes_that_come_again(self):
        op = blur("float32")
        for n in (6, 6, 6, 9, 9, 9, 6, 9):  # a call on the sizes of the one before is a shorter way
            image, taps = torch.rand(n), torch.rand(3, requires_grad=True)
            result = op(image, taps)
            want = sum(image[k:k + n - 2] * taps[k] for k in range(3))
            torch.testing.assert_close(result, want)
            gradient, = torch.autograd.grad(result.sum(), taps)
            torch.testing.assert_close(gradient, torch.autograd.grad(want.sum(), taps)[0])
            self.assertEqual(op(image[::2], taps).shape, ((n + 1) // 2 - 2,))

    def test_large_results(self):
        """Ask for huge pages, in the first call, in those of sizes that came before, and in the gradient."""
        image = rg.ImageParam("float32", 2, "image")
        f = rg.Func("squares")
        f[x, y] = image[x, y] * image[x, y]
        op, pixels = operator(f, [image]), torch.rand(2901, 2903, requires_grad=True)
        module = rg._retrograde
        with mock.patch.object(module, "_use_huge_pages", wraps=module._use_huge_pages) as asked:
            for _ in range(4):
                result = op(pixels)
                self.assertTrue(torch.equal(result, pixels * pixels))
                asked.assert_called_with(result.data_ptr(), 4 * 2901 * 2903)
            self.assertEqual(asked.call_count, 4)
            gradient, = torch.autograd.grad(result.sum(), pixels)
            self.assertEqual(asked.call_count, 5)
            op(pixels[:100])
            self.assertEqual(asked.call_count, 5)
        self.assertTrue(torch.equal(gradient, 2 * pixels.detach()))

    def test_sizes_that_values_say(self):
        count, f = rg.ImageParam("int64", 1, "count"), rg.Func("f")
        f[x] = count[0] + rg.cast("int64", x)
        op = operator(f, [count], lambda count: [int(count[0])])
        for n in (3, 3, 3, 5, 3):
            self.assertEqual(op(torch.tensor([n])).tolist(), list(range(n, 2 * n)))

    def test_forward_mode(self):
        import torch.autograd.forward_ad as forward
        op, taps = blur(), torch.tensor([1.0, 2, 1], dtype=torch.float64)
        image, direction = torch.rand(8, dtype=torch.float64), torch.rand(8, dtype=torch.float64)
        with forward.dual_level():
            moved = forward.unpack_dual(op(forward.make_dual(image, direction), taps)).tangent
        self.assertTrue(torch.allclose(moved, op(direction, taps)))
        self.assertEqual(op.made(), [(1, 0b1, 0)])

    def test_a_third_derivative(self):
        image, f = rg.ImageParam("float64", 1, "image"), rg.Func("f")
        f[x] = rg.sin(image[x])
        op, t = operator(f, [image]), torch.rand(4, dtype=torch.float64, requires_grad=True)
        value = op(t)
        for _ in range(3):
            value, = torch.autograd.grad(value.sum(), t, create_graph=True)
        self.assertTrue(torch.allclose(value, -torch.cos(t)))

    def test_an_output_of_integers(self):
        image, a, b = rg.ImageParam("float32", 1, "image"), rg.Func("a"), rg.Func("b")
        a[x] = rg.cast("int32", image[x])
        b[x] = 3 * image[x]
        t = torch.tensor([1.5, 2.5], requires_grad=True)
        whole, triple = operator([a, b], [image])(t)
        self.assertEqual((whole.tolist(), whole.requires_grad, triple.requires_grad), ([1, 2], False, True))
        triple.sum().backward()
        self.assertEqual(t.grad.tolist(), [3, 3])

    def test_autocast(self):
        op, image, taps = blur("float32"), torch.rand(8), torch.rand(3, requires_grad=True)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            result = op(image.bfloat16(), taps)
        self.assertEqual(result.dtype, torch.float32)
        self.assertTrue(torch.equal(result, op(image.bfloat16().float(), taps)))
        result.sum().backward()
        self.assertEqual(taps.grad.dtype, torch.float32)

    def test_what_no_kernel_is_for(self):
        op = blur("float32")
        has = torch._C._dispatch_has_kernel_for_dispatch_key
        for name in (op.overload.name(), op.derivative.name()):
            self.assertTrue(all(has(name, key) for key in ("CPU", "CUDA", "Meta", "Autograd", "AutocastCPU")))
        meta = op(torch.rand(8, device="meta"), torch.rand(3, device="meta"))
        self.assertEqual((meta.shape, meta.device.type), ((6,), "meta"))
        with self.assertRaisesRegex(TypeError, "image on meta, taps on cpu"):
            op(torch.rand(8, device="meta"), torch.rand(3))

    def test_after_fork(self):
        op, image, taps = blur("float32"), torch.ones(8), torch.ones(3)
        op(image, taps)
        child = os.fork()
        if child == 0:
            os._exit(0 if op(image, taps).tolist() == [3.0] * 6 else 1)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)

    @unittest.skipUnless(hasattr(torch, "func"), f"PyTorch {torch.__version__} has no functorch for such operators")
    def test_function_transforms(self):
        image, f = rg.ImageParam("float64", 1, "image"), rg.Func("f")
        f[x] = rg.sin(image[x])
        op, t = operator(f, [image]), torch.rand(4, dtype=torch.float64)
        from torch.func import grad, hessian, jacfwd, jacrev, jvp, vmap
        self.assertTrue(torch.allclose(grad(lambda t: op(t).sum())(t), torch.cos(t)))
        self.assertTrue(torch.allclose(grad(lambda t: grad(lambda t: op(t).sum())(t).sum())(t), -torch.sin(t)))
        self.assertTrue(torch.allclose(jacrev(op)(t), torch.diag(torch.cos(t))))
        self.assertTrue(torch.allclose(jacfwd(op)(t), torch.diag(torch.cos(t))))
        self.assertTrue(torch.allclose(hessian(lambda t: op(t).sum())(t), torch.diag(-torch.sin(t))))
        batch = torch.rand(2, 3, 4, dtype=torch.float64)
        self.assertTrue(torch.allclose(vmap(vmap(op))(batch), torch.sin(batch)))
        self.assertTrue(torch.allclose(jvp(op, (t,), (t,))[1], t * torch.cos(t)))
        with torch.no_grad():
            self.assertFalse(op(t.clone().requires_grad_()).requires_grad)

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


class Explanations(unittest.TestCase):
    def test_of_the_last_call(self):
        op, taps = blur("float32"), torch.rand(3, requires_grad=True)
        with self.assertRaisesRegex(rg.CompileError, "has not been called"):
            op.explain()
        op(torch.rand(500), taps).sum().backward()
        text = op.explain()
        self.assertIn("image: float32 [500], taps: float32 [3]", text)
        self.assertRegex(text, r"forward: \S+ ms\n")
        self.assertRegex(text, r'"blur": \S+ ms, \d+ %, bound by ')
        self.assertIn("backward, gradients of taps: ", text)
        self.assertIn('"gradient_of_taps"', text)
        self.assertNotRegex(text, r"\$\d")  # names are those of the program

    def test_of_shapes(self):
        op = blur("float32")
        text = op.explain((40,), (3,))
        self.assertIn("image: float32 [40]", text)
        self.assertIn("backward, gradients of image and taps: ", text)
        self.assertIn("one after the other (3)", text)
        self.assertEqual(op.explain(torch.rand(40), (3,)), text)
        batch = op.explain((2, 5, 40), (3,))
        self.assertIn("called for each of a batch of [2, 5]", batch)
        with self.assertRaisesRegex(TypeError, "a shape, a tensor or a number for each of image, taps"):
            op.explain((40,))

    def test_of_operators_for_known_sizes_and_of_integers(self):
        def define(kind, shapes):
            image, f = rg.ImageParam(kind, 2, "image"), rg.Func("f")
            f[x, y] = rg.exp(image[x, y])
            return f, [image]

        self.assertIn("image: float32 [20, 30]", operator("tests::explained", define).explain((20, 30)))
        image, f = rg.ImageParam("int32", 1, "image"), rg.Func("f")
        f[x] = image[x] + 1
        self.assertNotIn("backward", operator(f, [image]).explain((8,)))

    def test_say_which_sums_are_scatters(self):
        table, index, f = rg.ImageParam("float32", 1, "table"), rg.ImageParam("int64", 1, "index"), rg.Func("f")
        f[x] = table[rg.clamp(rg.cast("int32", index[x]), 0, 7)]
        text = operator(f, [table, index], lambda table, index: [index.shape[0]]).explain((8,), (100,))
        self.assertIn('the gradient of "table" is a sum at data-dependent indices', text)


class SizesOfDefinitions(unittest.TestCase):
    """A size is a number where shapes are known, and an expression elsewhere: both work alike, or say why not."""

    def define(self, use):
        def define(kind, shapes):
            image, f = rg.ImageParam(kind, 1, "image"), rg.Func("f")
            n = shapes[0][0] if shapes else image.dim(0).extent()
            use(f, image, n)
            return f, [image], lambda image: [image.shape[0]]
        return define

    def test_both_kinds_in_domains_and_arithmetic(self):
        def half_sum(f, image, n):
            r = rg.RDom([(0, n // 2)])
            f[x] = image[x] / n
            f[x] += image[r] + image[n - 1 - r]

        op, t = operator("tests::sizes", self.define(half_sum)), torch.rand(9)
        want = t / 9 + t[:4].sum() + t[5:].sum()
        torch.testing.assert_close(op(t), want)
        for n in range(2, 14):  # more than are compiled for themselves
            op(torch.rand(n))
        torch.testing.assert_close(op(torch.ones(21)), torch.full((21,), 1 / 21 + 20))

    def test_python_loops_need_numbers(self):
        def loop(f, image, n):
            f[x] = sum(image[k] for k in range(n))

        with self.assertRaisesRegex(rg.CompileError, "an integer of Python.*known when a pipeline runs"):
            operator("tests::loop", self.define(loop))

    def test_definitions_that_need_shapes_say_so(self):
        def define(kind, shapes):
            raise_if_none = shapes[0]
            return raise_if_none

        with self.assertRaisesRegex(rg.CompileError, "raised TypeError.*also called with shapes=None") as caught:
            operator("tests::needs", define)
        self.assertIn("image.dim(0).extent()", caught.exception.instead)


def total(name):
    a, b, f = rg.ImageParam("float32", 1, "a"), rg.ImageParam("float32", 1, "b"), rg.Func("total")
    f[x] = a[x] + b[x]
    return operator(f"tests::{name}", f, [a, b])


class PastTheDispatcher(unittest.TestCase):
    """Calls for which the dispatcher has nothing to decide go past it; whoever looks at calls there sees them still."""

    def setUp(self):
        self.a, self.b = torch.rand(3), torch.rand(3, requires_grad=True)

    def test_ordinary_calls_go_past_it(self):
        op = total("goes_past")
        with mock.patch.object(type(op._calls), "dispatch", side_effect=AssertionError):
            result = op(self.a, self.b)
            self.assertTrue(torch.equal(result, self.a + self.b))
            result.sum().backward()
            self.assertEqual(self.b.grad.tolist(), [1, 1, 1])
            self.assertFalse(op(self.a, self.b.detach()).requires_grad)
            with torch.no_grad():
                self.assertFalse(op(self.a, self.b).requires_grad)

    def test_modes_see_calls(self):
        from torch.utils._python_dispatch import TorchDispatchMode
        seen = []

        class Watch(TorchDispatchMode):
            def __torch_dispatch__(self, function, types, args=(), kwargs=None):
                seen.append(str(function))
                return function(*args, **(kwargs or {}))

        op = total("watched")
        op(self.a, self.b)
        with Watch():
            op(self.a, self.b).sum().backward()
        self.assertIn("tests.watched.default", seen)
        self.assertIn("tests.watched_derivative.default", seen)

    def test_subclasses_see_calls(self):
        class Watched(torch.Tensor):
            seen = []

            @classmethod
            def __torch_function__(cls, function, types, args=(), kwargs=None):
                cls.seen.append(str(function))
                return super().__torch_function__(function, types, args, kwargs or {})

        self.assertIsInstance(total("of_subclass")(self.a.as_subclass(Watched), self.b), Watched)
        self.assertTrue(any("of_subclass" in one for one in Watched.seen), Watched.seen)

    def test_profilers_see_calls(self):
        op = total("profiled")
        op(self.a, self.b)
        with torch.autograd.profiler.profile() as seen:
            op(self.a, self.b)
        self.assertIn("tests::profiled", {event.name for event in seen.function_events})

    def test_traces_see_calls(self):
        op = total("traced")
        traced = torch.jit.trace(lambda a, b: op(a, b), (self.a, self.b.detach()))
        self.assertIn("tests::traced", str(traced.graph))

    def test_what_runs_below_autograd_is_not_differentiated(self):
        op = total("below")
        guard = torch._C._AutoDispatchBelowAutograd()
        try:
            self.assertFalse(op(self.a, self.b).requires_grad)
        finally:
            del guard
        with torch.inference_mode():
            self.assertTrue(op(self.a, self.b).is_inference())

    def test_tensors_without_memory_are_refused(self):
        op = total("sparse")
        for _ in range(3):
            op(self.a, self.b)
            with self.assertRaises(RuntimeError):
                op(self.a.to_sparse(), self.b.detach())

    @unittest.skipUnless(hasattr(torch, "set_default_device"), "there is no default device")
    def test_results_are_where_the_tensors_are(self):
        op = total("of_device")
        with torch.device("meta"):
            self.assertEqual(op(self.a, self.b).device.type, "cpu")


if __name__ == "__main__":
    unittest.main()
