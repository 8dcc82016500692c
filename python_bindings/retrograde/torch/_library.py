"""Registers operators with PyTorch through torch.library.

An operator registers two names: `name(a, b, ...)`, and `name_derivative(tensors, path)` for its derivatives of every
order and both modes. The path selects a derivative; see Plan.derived. Both are registered when the operator is created,
so that compiled graphs that PyTorch has cached on disk find them. Each has a kernel for

    CPU            runs the pipeline
    CUDA           runs it as kernels, on the current stream
    Meta (fake)    returns the shapes and types of the results
    Autograd       an autograd.Function with backward and jvp, which call the derivative operator
    Autocast       casts to the types of the pipeline, whatever the mode
    vmap, Batched  makes one batched call, since the kernels accept batches

With PyTorch 1.13 there is no vmap and there are no functorch transforms of such operators; all else is the same.

Calls that need nothing from the dispatcher bypass it (_direct.py).
"""
import threading

import torch
from torch.autograd import forward_ad

from .._errors import Unsupported, error
from ._direct import count_maps, is_compiling, is_direct
from ._plan import GRADIENT, TANGENT

if tuple(int(n) for n in torch.__version__.split(".")[:2]) < (1, 13):
    raise error(Unsupported, "make operators of PyTorch", "it is PyTorch 1.13 or later", f"this is {torch.__version__}",
                "Install a later one")

_lock, _libraries, _names = threading.Lock(), {}, set()
_HAS_FRAGMENTS = hasattr(torch.library, "register_fake")
_are_transforms_active = torch._C._are_functorch_transforms_active if hasattr(torch, "func") else lambda: False
if hasattr(torch, "func"):
    from torch._functorch.utils import enable_single_level_autograd_function as _enable_single_level


def _library(namespace):
    """The library of a namespace. It lives as long as the process, because operators cannot be unregistered."""
    if namespace not in _libraries:
        _libraries[namespace] = torch.library.Library(namespace, "FRAGMENT" if _HAS_FRAGMENTS else "DEF")
    return _libraries[namespace]


def register(operator):
    """Defines both operators; returns the object that calls them."""
    namespace, name = operator.name.split("::")
    with _lock:
        if operator.name in _names or hasattr(getattr(torch.ops, namespace), name):
            raise error(ValueError, f'register the operator "{operator.name}"', "a name is given once",
                        "there is an operator of that name", "Choose another name, or leave it out")
        _names.add(operator.name)
        library = _library(namespace)
        tags = {"tags": (torch.Tag.pt2_compliant_tag,)} if hasattr(torch.Tag, "pt2_compliant_tag") else {}
        library.define(f"{name}({', '.join(f'Tensor {n}' for n in operator.argument_names)}) -> "
                       + ("Tensor" if operator.single else f"({', '.join(['Tensor'] * operator.results)})"), **tags)
        library.define(f"{name}_derivative(Tensor[] tensors, int[] path) -> Tensor[]", **tags)
        return Calls(operator, library, namespace, name)


class Calls:
    """The kernels of an operator and of its derivatives, and calls of both. Internally every call takes a path and
    tensors, two tuples, and returns a list."""

    def __init__(self, operator, library, namespace, name):
        self.operator, self._last, self._functions = operator, {}, {}
        self._trainings = {}  # by the inputs to differentiate by: types and shapes of the last call, its Training
        self.seen = {}  # by path: types and shapes of the last call, for explain()
        kernels = {"CPU": self.run, "CUDA": self.run_on_device, "Autograd": self.differentiate,
                   "AutocastCPU": self.cast, "AutocastCUDA": self.cast, "Batched": self.take_batch}
        for key, kernel in kernels.items():
            library.impl(name, self.of_operator(kernel), key)
            library.impl(name + "_derivative", of_derivative(kernel), key)
        names = f"{namespace}::{name}", f"{namespace}::{name}_derivative"
        if hasattr(torch.library, "register_fake"):
            torch.library.register_fake(names[0], self.of_operator(self.fake), lib=library)
            torch.library.register_fake(names[1], of_derivative(self.fake), lib=library)
        else:
            library.impl(name, self.of_operator(self.fake), "Meta")
            library.impl(name + "_derivative", of_derivative(self.fake), "Meta")
        if hasattr(torch.library, "register_vmap"):
            torch.library.register_vmap(names[0], self.vmap_operator, lib=library)
            torch.library.register_vmap(names[1], self.vmap_derivative, lib=library)
        operators = getattr(torch.ops, namespace)
        operator.overload = self.overload = getattr(operators, name).default
        operator.derivative = self.derivative = getattr(operators, name + "_derivative").default

    def of_operator(self, kernel):
        if self.operator.single:
            return lambda *tensors: kernel((), tensors)[0]
        return lambda *tensors: tuple(kernel((), tensors))

    def __call__(self, path, tensors):
        """Calls the operator, directly if possible and otherwise through the dispatcher."""
        if is_compiling() or not is_direct(tensors):
            return self.dispatch(path, tensors)
        return self.direct(path, tensors)

    def direct(self, path, tensors):
        """A call without the dispatcher; requires is_direct(tensors)."""
        if torch.is_grad_enabled() and _any_requires_grad(*tensors):
            return self.differentiably(path)(self.run, *tensors)
        return self.run(path, tensors)

    def dispatch(self, path, tensors):
        if path:
            return self.derivative(list(tensors), list(path))
        result = self.overload(*tensors)
        return [result] if self.operator.single else list(result)

    # ---- the kernels ----

    def run(self, path, tensors):
        last = self._last.get(path)  # most calls have the same sizes as the previous one
        if last is not None:
            results = last(tensors)
            if results is not None:
                return results
        plan = self.operator.plan_for(path, tensors)
        results = plan.run(tensors)
        self._last[path] = plan.expected
        self._see(path, tensors)
        return results

    def run_keeping(self, tensors, wanted):
        """Runs the operator for a gradient by the inputs at these positions. Returns the results, the Training that the
        gradient belongs to, and the residuals for it; None if there are no residuals (_training.py)."""
        kinds = [(t.dtype, t.shape) for t in tensors]
        mask = _mask(wanted)
        known, training = self._trainings.get(mask, (None, None))
        if known != kinds:
            training = self.operator.training_for(mask, tensors)
            self._trainings[mask] = kinds, training
            if training is not None:
                self._see((), tensors)
        results = None if training is None else training.run_forward(tensors)
        if results is None:
            return None
        return results[:training.results], training, results[training.results:]

    def gradient(self, path, step, training, tensors, residuals, seeds):
        """The gradients for seeds; a gradient of gradients cannot follow from residuals."""
        if training is not None and training.step == step and not torch.is_grad_enabled() \
                and is_direct((*tensors, *residuals, *seeds)):
            gradients = training.run_backward(tensors, residuals, seeds)
            if gradients is not None:
                if step not in self.seen:
                    self._see(step, (*tensors, *seeds))
                return gradients
        return self((*path, *step), (*tensors, *seeds))

    def _see(self, path, tensors):
        self.seen.pop(path, None)  # the last one is the last of the dict
        self.seen[path] = [(t.dtype, tuple(t.shape)) for t in tensors]

    def fake(self, path, tensors):
        return self.operator.plan(path, tensors).fake(tensors)

    def run_on_device(self, path, tensors):
        self._see(path, tensors)
        return self.operator.plan_for(path, tensors).run_on_device(tensors)

    def differentiate(self, path, tensors):
        if forward_ad._current_level < 0 and not (torch.is_grad_enabled() and _any_requires_grad(*tensors)):
            return self.below(path, tensors)
        if not _are_transforms_active():
            return list(self.differentiably(path)(self.below, *tensors))
        # Like autograd.Function.apply, but for one level of functorch's transforms, that of the calling kernel; inner
        # levels return through the dispatcher. Autograd also disables modes that belong to inner levels.
        grad, forward = torch.is_grad_enabled(), torch._C._is_fwd_grad_enabled()

        def below(path, tensors):
            with torch.set_grad_enabled(grad), forward_ad._set_fwd_grad_enabled(forward):
                return self.below(path, tensors)

        with _enable_single_level():
            return list(self.differentiably(path)(below, *tensors))

    def differentiably(self, path):
        """A function of a runner of (path, tensors) and of the tensors, whose results autograd records."""
        function = self._functions.get(path)
        if function is None:
            function = self._functions.setdefault(path, _function_of(self, path))
        return function

    def below(self, path, tensors):
        """Calls the kernels below autograd."""
        if is_direct(tensors):
            return self.run(path, tensors)
        guard = torch._C._AutoDispatchBelowAutograd()
        try:
            return self.dispatch(path, tensors)
        finally:
            del guard

    def cast(self, path, tensors):
        dtypes = self.operator.plan(path, tensors).dtypes
        cast = [t.to(dtype) if t.dtype.is_floating_point and dtype.is_floating_point else t
                for t, dtype in zip(tensors, dtypes)]
        with torch.autocast("cpu", enabled=False), torch.autocast("cuda", enabled=False):
            return self.dispatch(path, cast)

    # ---- vmap: puts the vmapped dimension in front of the other batch dimensions ----

    def vmap_operator(self, info, dims, *tensors):
        results = self.dispatch((), self._batched((), tensors, dims))
        return (results[0], 0) if self.operator.single else (tuple(results), (0,) * len(results))

    def vmap_derivative(self, info, dims, tensors, path):
        results = self.dispatch(path, self._batched(path, tensors, dims[0]))
        return results, [0] * len(results)

    def take_batch(self, path, tensors):
        """The kernel for an older vmap, which autograd uses for batches of gradients, and jacobian and hessian for
        vectors. Its tensors hide one dimension for each level. The innermost hidden dimension of any tensor moves to
        the front for the call, and back afterwards."""
        level, has_level = _innermost_level(tensors)
        shown = [torch._remove_batch_dim(t, level, 1, 0) if has else t for t, has in zip(tensors, has_level)]
        results = self.dispatch(path, self._batched(path, shown, [0 if has else None for has in has_level]))
        return [torch._add_batch_dim(result, 0, level) for result in results]

    def _batched(self, path, tensors, dims):
        ranks = self.operator.plan(path, tensors).ranks
        before = [t.dim() - rank - (dim is not None) for t, rank, dim in zip(tensors, ranks, dims)]
        moved = []
        for t, dim, has in zip(tensors, dims, before):
            if dim is not None:
                t = t.movedim(dim, 0)
                t = t.reshape(t.shape[:1] + (1,) * (max(before) - has) + t.shape[1:])
            moved.append(t)
        return moved


def _innermost_level(tensors):
    """The innermost level of the older vmap in the tensors, and a list of which tensors have it."""
    for level in range(count_maps(), 0, -1):
        # A tensor without this level is expanded to the given size.
        has_level = [torch._remove_batch_dim(t, level, 1, 0).shape[0] == torch._remove_batch_dim(t, level, 2, 0).shape[0]
                     for t in tensors]
        if any(has_level):
            return level, has_level
    raise error(RuntimeError, "map an operator over a batch", "a tensor of the batch is of a level of vmap",
                "none is", "Use torch.func.vmap")


def of_derivative(kernel):
    return lambda tensors, path: kernel(tuple(path), tuple(tensors))


# ---- derivatives ----

def _each_requires_grad(*tensors):
    for t in tensors:
        if t.requires_grad:
            return True
    return False


_any_requires_grad = getattr(torch._C, "_any_requires_grad", _each_requires_grad)


def _mask(places):
    return sum(1 << i for i in places)


def _function_of(calls, path):
    """The autograd.Function of one path. The path is not an argument of calls, because autograd inspects each one."""
    def wanted_of(ctx, tensors):
        return [i for i, t in enumerate(tensors) if ctx.needs_input_grad[i + 1] and t.dtype.is_floating_point]

    class Call(torch.autograd.Function):
        @staticmethod
        def forward(ctx, below, *tensors):
            ctx.set_materialize_grads(False)
            ctx.training, residuals = None, ()
            kept = None
            if not path and below == calls.run and calls.operator.knows_sizes:
                kept = calls.run_keeping(tensors, wanted_of(ctx, tensors))
            if kept is not None:
                results, ctx.training, residuals = kept
            else:
                results = below(path, tensors)
            ctx.save_for_backward(*tensors, *residuals)
            if forward_ad._current_level >= 0:
                ctx.save_for_forward(*tensors)
            return tuple(results)

        @staticmethod
        def backward(ctx, *seeds):
            saved = ctx.saved_tensors
            tensors, residuals = saved[:len(ctx.needs_input_grad) - 1], saved[len(ctx.needs_input_grad) - 1:]
            wanted = wanted_of(ctx, tensors)
            given = [i for i, seed in enumerate(seeds) if seed is not None and seed.dtype.is_floating_point]
            results = [None] * len(tensors)
            if wanted and given:
                step = GRADIENT, _mask(wanted), _mask(given)
                # Dense seeds: autograd's seeds of sums have stride 0, for which pipelines would be recompiled.
                gradients = calls.gradient(path, step, ctx.training, tensors, residuals,
                                           tuple(seeds[i].contiguous() for i in given))
                for i, gradient in zip(wanted, gradients):
                    # Sums the gradient of a tensor that all items of the batch share.
                    shape = tensors[i].shape
                    results[i] = gradient if gradient.shape == shape else gradient.sum_to_size(shape)
            return (None, *results)

        @staticmethod
        def jvp(ctx, _below, *tangents):
            given = [i for i, t in enumerate(tangents) if t is not None]
            moved = calls((*path, TANGENT, _mask(given), 0), (*ctx.saved_tensors, *(tangents[i] for i in given)))
            return tuple(t if t.dtype.is_floating_point else None for t in moved)

    return super(torch.autograd.Function, Call).apply
