"""A pipeline as a function of tensors, with the pipelines of its derivatives.

Tensors may have additional leading dimensions, which form a batch. Batch dimensions are broadcast as in PyTorch, and
each item of the batch is a separate call.
"""
import functools
import itertools
import math
import threading

import torch

from .. import _retrograde as rg
from .._errors import CompileError, error
from .._explain import plain
from ._device import device_of
from ._outside import naming_tensors

DTYPES = {torch.float16: rg.Float(16), torch.bfloat16: rg.BFloat(16), torch.float32: rg.Float(32),
          torch.float64: rg.Float(64), torch.uint8: rg.UInt(8), torch.int8: rg.Int(8), torch.int16: rg.Int(16),
          torch.int32: rg.Int(32), torch.int64: rg.Int(64), torch.bool: rg.Bool()}
TYPES = {str(kind): dtype for dtype, kind in DTYPES.items()}
GRADIENT, TANGENT = 0, 1  # the steps of a path: see Plan.derived
_CPU = torch.device("cpu")
_HUGE = 32 << 20  # bytes; malloc maps new memory for each block of at least this size
_numbers = itertools.count()


def dtype_of(thing):
    """The torch.dtype of a Func's or parameter's elements."""
    if str(thing.type()) not in TYPES:
        raise error(CompileError, f'make an operator of "{thing.name()}"', "its elements are those of a tensor",
                    f"they are {thing.type()}", f"Use one of {', '.join(TYPES)}")
    return TYPES[str(thing.type())]


def bits(mask):
    """The positions of the bits that are set."""
    return [i for i in range(mask.bit_length()) if mask >> i & 1]


def is_image(parameter):
    return isinstance(parameter, rg.ImageParam)


class Plan:
    """A compiled pipeline with outputs and inputs. `shapes` computes the shapes of the outputs, in PyTorch's order,
    from the tensors of one batch item. `sizes` holds the shapes of the inputs if the plan is for these only, or None.
    `facts()` is what Derivative.explanations() says about a gradient."""

    facts = list

    def __init__(self, name, outputs, inputs, shapes, sizes=None):
        self.name, self.outputs, self.inputs, self._shapes = name, list(outputs), list(inputs), shapes
        self.sizes = sizes
        for f in self.outputs:
            if f.outputs() != 1:
                raise error(CompileError, f'make an operator of "{f.name()}"', "a tensor holds one value at each point",
                            f"it has {f.outputs()} values", "Give a Func for each of them")
        self.names = [parameter.name() for parameter in self.inputs]
        self.dtypes = [dtype_of(parameter) for parameter in self.inputs]
        self.ranks = [parameter.dimensions() if is_image(parameter) else 0 for parameter in self.inputs]
        self.result_dtypes = [dtype_of(f) for f in self.outputs]
        self._images = [is_image(parameter) for parameter in self.inputs]
        self._last_kinds, self.expected = None, None  # see _expect
        self._lock, self._callable, self._derived = threading.RLock(), None, {}
        self.wanted, self.trainings = (), {}  # of a gradient: the inputs that it differentiates by; see _training.py
        self._on_devices = {}  # compiled, by target
        self._result_shapes, self._seeds = None, 0  # _seeds: number of seeds, which are the last inputs
        if sizes is not None:
            self._result_shapes = shapes([torch.empty(size, dtype=dtype, device="meta")
                                          for size, dtype in zip(sizes, self.dtypes)])
            for parameter, size in zip(self.inputs, sizes):
                _set_bounds(parameter, size)
            for f, size in zip(self.outputs, self._result_shapes):
                _set_bounds(f.output_buffer(), size)

    # ---- arguments ----

    def check(self, tensors):
        """Raises TypeError if types or ranks do not fit. Returns whether there is a batch."""
        if len(tensors) != len(self.inputs):
            self._refuse(tensors)
        has_batch = False
        for tensor, dtype, rank in zip(tensors, self.dtypes, self.ranks):
            more = tensor.dim() - rank
            if tensor.dtype is not dtype or more < 0:
                self._refuse(tensors)
            has_batch |= more > 0
        return has_batch

    def _refuse(self, tensors):
        def shown(names, dtypes, shapes):
            return ", ".join(f"{n}: {str(d)[6:]} {s}" for n, d, s in zip(names, dtypes, shapes))

        names = self.names + [f"argument {i}" for i in range(len(self.names), len(tensors))]
        raise error(TypeError, f'call the operator "{self.name}"',
                    f"it takes {shown(self.names, self.dtypes, [f'over {rank} dimensions' for rank in self.ranks])}",
                    f"given are {shown(names, [t.dtype for t in tensors], [list(t.shape) for t in tensors])}",
                    "Convert them with tensor.to(dtype); dimensions in front of an image's own are a batch")

    def batch(self, tensors):
        """The sizes of the batch; () without a batch."""
        leading = [t.shape[:t.dim() - rank] for t, rank in zip(tensors, self.ranks) if t.dim() > rank]
        if not leading:
            return ()
        try:
            return tuple(torch.broadcast_shapes(*leading))
        except RuntimeError:
            shapes = ", ".join(f"{name} {list(t.shape)}" for name, t in zip(self.names, tensors))
            raise error(TypeError, f'call the operator "{self.name}" on a batch', "sizes of the batch are equal or 1",
                        f"given are {shapes}", "Give each tensor the same leading sizes, or none") from None

    def shapes(self, tensors, batch):
        """The shapes of the results."""
        if self._result_shapes is not None:
            return [batch + shape for shape in self._result_shapes] if batch else self._result_shapes
        if batch:
            tensors = [torch.empty(t.shape[t.dim() - rank:], dtype=t.dtype, device="meta")
                       for t, rank in zip(tensors, self.ranks)]
        return [batch + shape for shape in self._shapes(tensors)]

    # ---- calls ----

    def fake(self, tensors):
        """Results without values, which only have shapes and types."""
        self.check(tensors)
        device = self.place(tensors)
        return [torch.empty(shape, dtype=dtype, device=device)
                for shape, dtype in zip(self.shapes(tensors, self.batch(tensors)), self.result_dtypes)]

    def place(self, tensors):
        """The device of the images; None without images."""
        devices = {t.device for t, image in zip(tensors, self._images) if image}
        if len(devices) > 1:
            places = ", ".join(f"{name} on {t.device}" for name, t in zip(self.names, tensors))
            raise error(TypeError, f'call the operator "{self.name}"', "its tensors are on one device",
                        f"given are {places}", "Move them with tensor.to(device)")
        return devices.pop() if devices else None

    def run(self, tensors):
        batch = self.batch(tensors) if self.check(tensors) else ()
        shapes = self.shapes(tensors, batch)
        results = [_empty(shape, dtype) for shape, dtype in zip(shapes, self.result_dtypes)]
        if self.sizes is None and self._is_trivial(tensors, results):
            return results
        if not batch:
            self._call(tensors, results)
            self._expect(tensors, shapes)
        else:
            self._call_each(self._call, batch, tensors, results)
        return results

    def run_on(self, device, tensors):
        """Runs on images of a device (_device.py). The work is queued in its current stream."""
        batch = self.batch(tensors) if self.check(tensors) else ()
        with device.current():
            results = [device.empty(shape, dtype)
                       for shape, dtype in zip(self.shapes(tensors, batch), self.result_dtypes)]
            if self._is_trivial(tensors, results):
                return results
            # Numbers are kernel arguments, so they must be on the host.
            tensors = [t if image else t.cpu() for t, image in zip(tensors, self._images)]
            call = functools.partial(self._call_on, device)
            if batch:
                self._call_each(call, batch, tensors, results)
            else:
                call(tensors, results)
        return results

    def run_on_device(self, tensors):
        """Runs on the device of the images."""
        place = self.place(tensors)
        if place is None or place.type == "cpu":  # only numbers are on another device
            return self.run([t.cpu() for t in tensors])
        return self.run_on(device_of(place), tensors)

    def _call_each(self, call, batch, tensors, results):
        """One call for each item of the batch."""
        if 0 in batch:
            return
        wide = [t.expand(batch + tuple(t.shape[t.dim() - rank:])) for t, rank in zip(tensors, self.ranks)]
        for at in itertools.product(*map(range, batch)):
            call([t[at] for t in wide], [t[at] for t in results])

    def _is_trivial(self, tensors, results):
        """Whether nothing need run: the results are empty, or the seeds of a gradient are, and the results are then
        filled with zeros. The loops of a pipeline must have at least one iteration."""
        if self._seeds and all(t.numel() == 0 for t in tensors[-self._seeds:]):
            for result in results:
                result.zero_()
            return True
        return all(result.numel() == 0 for result in results)

    def _call(self, tensors, results):
        if self._callable is None:
            with self._lock:
                if self._callable is None:
                    self._callable = self._compile_for(rg.get_jit_target_from_environment())
        with naming_tensors(self, tensors, results):
            self._callable._call_tensors((*tensors, *results))

    def _call_on(self, device, tensors, results):
        found = self._on_devices.get(device.target)
        if found is None:
            with self._lock:
                if device.target not in self._on_devices:
                    self._on_devices[device.target] = self._compile_for(rg.Target(device.target))
                found = self._on_devices[device.target]
        with naming_tensors(self, tensors, results):
            found._call_tensors_on_device((*tensors, *results), device.stream())

    def _compile_for(self, target):
        """Compiles a copy with an automatic schedule for the target, unless the user gave directives."""
        return rg.Pipeline(self.outputs)._scheduled_copy(target).compile_to_callable(self.inputs, target)

    def _expect(self, tensors, shapes):
        """After two calls with the same sizes, sets `expected`, a faster run() that returns None for other sizes. It is
        not set if the shapes of the results depend on more than the shapes of the tensors."""
        kinds = [(t.dtype, tuple(t.shape)) for t in tensors]
        if kinds != self._last_kinds:
            self._last_kinds = kinds
            return
        try:
            alone = self.shapes([torch.empty(shape, dtype=dtype, device="meta") for dtype, shape in kinds], ())
        except Exception:  # a user's function reads values, which these tensors lack
            return
        if [tuple(one) for one in alone] == [tuple(one) for one in shapes]:
            makers = [_maker(tuple(one), dtype) for one, dtype in zip(shapes, self.result_dtypes)]
            self.expected = rg._ExpectedCall(self._callable, kinds, makers)

    # ---- derivatives ----

    def derived(self, path):
        """The plan of a derivative. A path consists of steps of three numbers; sets of inputs or outputs are bit masks.
        GRADIENT, wanted, given: takes the inputs and a seed for each output in `given`; computes the gradients with
        respect to the inputs in `wanted`.
        TANGENT, given, 0: takes the inputs and a tangent for each input in `given`; computes the tangents of all
        outputs."""
        if not path:
            return self
        step = tuple(path[:3])
        with self._lock:
            if step not in self._derived:
                make = self._gradient if step[0] == GRADIENT else self._tangent
                self._derived[step] = make(bits(step[1]), bits(step[2]))
        return self._derived[step].derived(path[3:])

    def made(self):
        """The paths of all derivatives that exist."""
        return sorted(step + rest for step, plan in self._derived.items() for rest in [(), *plan.made()])

    def _gradient(self, wanted, given):
        by = [self.inputs[i] for i in wanted]
        seeds, adjoints = [], []
        for i in given:
            f = self.outputs[i]
            seed = rg.ImageParam(f.type(), f.dimensions(), f"seed_{next(_numbers)}_of_{plain(f.name())}")
            if self.sizes is None:
                bounds = [(seed.dim(d).min(), seed.dim(d).extent()) for d in range(seed.dimensions())]
            else:
                bounds = [(0, size) for size in reversed(self._result_shapes[i])]
            seeds.append(seed)
            adjoints.append((f, rg.Func(seed), bounds))
        derivative = rg.propagate_adjoints(adjoints, rg.AdjointOptions(wrt=by))
        gradients = [_as_gradient(derivative(parameter), parameter) for parameter in by]
        sizes = None if self.sizes is None else [*self.sizes, *(self._result_shapes[i] for i in given)]
        plan = Plan(f"{self.name}, gradient", gradients, self.inputs + seeds,
                    lambda tensors: [tuple(tensors[i].shape) for i in wanted], sizes)
        plan._seeds, plan.facts, plan.wanted = len(seeds), derivative.explanations, wanted
        return plan

    def _tangent(self, given, _):
        directions, tangents = [], []
        for parameter in (self.inputs[i] for i in given):
            dimensions = parameter.dimensions() if is_image(parameter) else 0
            name = f"tangent_{next(_numbers)}_of_{plain(parameter.name())}"
            tangents.append(rg.ImageParam(parameter.type(), dimensions, name))
            directions.append(rg.Direction(parameter, rg.Func(tangents[-1])))
        moved = [func_as(f.type(), f.dimensions(), f"tangent_of_{plain(f.name())}",
                         rg.propagate_tangents(f, directions)(f) if f.type().is_float() else None) for f in self.outputs]
        count = len(self.inputs)
        sizes = None if self.sizes is None else [*self.sizes, *(self.sizes[i] for i in given)]
        return Plan(f"{self.name}, tangent", moved, self.inputs + tangents,
                    lambda tensors: self._shapes(tensors[:count]), sizes)


def _maker(shape, dtype):
    """A function that creates a result tensor. For small tensors it copies the layout of another tensor, which takes
    half as long as creating one from sizes."""
    if math.prod(shape) <= 4096:
        return functools.partial(torch.empty_like, torch.empty(shape, dtype=dtype, device=_CPU))
    return functools.partial(_empty, shape, dtype)


def _empty(shape, dtype):
    """A result tensor without values. A large one is new memory in each call, and writing it causes page faults. Huge
    pages reduce their number, as for large NumPy arrays and for temporaries of a pipeline."""
    result = torch.empty(shape, dtype=dtype, device=_CPU)
    size = result.numel() * result.element_size()
    if size >= _HUGE:
        rg._use_huge_pages(result.data_ptr(), size)
    return result


def _set_bounds(buffer, size):
    """Promises the bounds of an image or an output; `size` is in PyTorch's order."""
    for d, extent in enumerate(reversed(size)):
        buffer.dim(d).set_bounds(0, extent)


def _as_gradient(adjoint, parameter):
    """An adjoint as a Func with the type of the parameter; the adjoint may be wider."""
    dimensions = parameter.dimensions() if is_image(parameter) else 0
    return func_as(parameter.type(), dimensions, f"gradient_of_{plain(parameter.name())}", adjoint)


def func_as(type, dimensions, name, part):
    """A Func with the values of another one, if there is any, in a type."""
    result = rg.Func(name)
    at = tuple(rg.Var(f"d{d}") for d in range(dimensions))
    result[at] = rg.cast(type, part[at] if part is not None and part.defined() else 0)
    return result
