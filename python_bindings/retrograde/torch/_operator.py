"""operator(): creates an operator of PyTorch from a pipeline."""
import inspect
import itertools
import re
import threading
import uuid

import torch

from .. import _retrograde as rg
from .._errors import CompileError, error
from . import _library
from ._direct import is_compiling, is_direct
from ._explaining import explain
from ._pickling import Function, describe, described, restored_outputs, stored_outputs
from ._plan import Plan, is_image
from ._sizes import Sizes
from ._training import training_of

_numbers = itertools.count()
MOST_SIZES = 8  # maximum number of sizes for which an operator is compiled separately


def operator(name, pipeline=None, inputs=None, outputs=None, *, sizes=None):
    """Creates the operator "ns::name". It takes tensors for ImageParams, and tensors or numbers for Params, in the
    order of `inputs`. It returns a tensor for a Func, and a tuple of tensors for a list of Funcs or a Pipeline.

    `outputs` (or `sizes`) gives the sizes of the result, innermost first, or a list of these for several results. A
    size is a number or an expression, such as image.dim(0).extent() - 2. `outputs` may also be a function that computes
    the sizes from the tensors. None means the sizes of the first image. Under torch.compile with dynamic shapes the
    function should read t.shape rather than len(t), which is a constant of a single call.

    Without a name, operator(pipeline, inputs, outputs) generates one.

    `pipeline` may also be a function of an element type such as "float32" that returns (pipeline, inputs) or
    (pipeline, inputs, outputs); `sizes` may be given to operator() instead. Then one definition serves tensors of all
    floating-point types. The first input that is float32 in the definition for "float32" determines the type of a call.
    A function of two arguments, (type, shapes), also receives the shapes of the tensors, in PyTorch's order. So does one
    of any number of arguments, (*both), but none whose second argument has a default other than None. Its result is
    compiled for these shapes only, which is faster than general code. It is also called with None: once when the
    operator is created, and after MOST_SIZES different shapes for all others. Sizes are then expressions, such as
    image.dim(0).extent(). They work in an RDom and in arithmetic; `//` divides both kinds alike, while `/` of two
    Python integers is a float. Python's range() and int() need numbers."""
    if not isinstance(name, str):
        name, pipeline, inputs, outputs = None, name, pipeline, outputs if inputs is None else inputs
    return _registered(Operator(name, pipeline, inputs, sizes if outputs is None else outputs))


# The operators of this process, by name and by the unique mark in their pickles. Generated names are not unique across
# processes.
_by_name, _by_mark, _registering = {}, {}, threading.RLock()


def _registered(operator):
    """Registers the operator, or returns one with the same definition that was restored from a pickle."""
    with _registering:
        known = _by_name.get(operator.name)
        if known is not None and known._is_restored and known._signature() == operator._signature():
            return known
        operator._register()
        _by_name[operator.name] = _by_mark[operator._mark] = operator
    return operator


def _restored(name, mark, signature, definition, description, outputs=None):
    """Restores an operator from the contents of a pickle."""
    with _registering:
        known = _by_mark.get(mark) or (name and _by_name.get(name))
        if known is None:
            parts = (definition.function, None, restored_outputs(outputs)) if definition else described(*description)
            known = Operator(name, *parts)
            known._mark, known._is_restored = mark, True
            _registered(known)
        if known._signature() != signature:
            raise error(ValueError, f'restore the operator "{name}"', "a name is given once",
                        f"there is an operator of that name that {_shown(known._signature())}, and the stored one "
                        f"{_shown(signature)}", "Choose another name for one of them")
        _by_mark[mark] = known
    return known


def _shown(signature):
    inputs, results = signature
    return f"takes {', '.join(f'{name}: {kind}' for name, kind, _ in inputs)} and gives {', '.join(results)}"


def _funcs(name, pipeline):
    """The Funcs of a pipeline, and whether it is a single Func."""
    if isinstance(pipeline, rg.Func):
        return [pipeline], True
    if isinstance(pipeline, rg.Pipeline):
        return pipeline.outputs(), False
    funcs = list(pipeline) if isinstance(pipeline, (list, tuple)) else [pipeline]
    for one in funcs:
        if not isinstance(one, rg.Func):
            raise error(TypeError, f'make the operator "{name}"', "a result is a Func", f"one is {_named(one)}",
                        "Define a Func of it, as in f[x] = image[x]" if isinstance(one, rg.ImageParam) else
                        "Give a Func, a list of Funcs or a Pipeline")
    return funcs, False


def _named(thing):
    kind = type(thing).__name__
    return f'the {kind} "{thing.name()}"' if isinstance(thing, rg.ImageParam) else f"an object of type {kind}"


def _parts(name, definition):
    """A definition as a tuple (pipeline, inputs, outputs)."""
    if not isinstance(definition, (list, tuple)) or len(definition) not in (2, 3):
        raise error(TypeError, f'make the operator "{name}"', "a definition returns (pipeline, inputs) or (pipeline, "
                    "inputs, outputs)", f"it returned {_named(definition)}" if not isinstance(definition, tuple) else
                    f"it returned {len(definition)} values", "Return the Func and the list of its inputs")
    return (*definition, None)[:3]


def _takes_shapes(define):
    """Whether a definition takes shapes after the element type. A parameter with a value of its own does not count."""
    parameters = list(inspect.signature(define).parameters.values())
    if any(p.kind is p.VAR_POSITIONAL for p in parameters[:2]):
        return True
    placed = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    return len(placed) > 1 and placed[1].default in (None, inspect.Parameter.empty)


def _check_is_alone(name, inputs):
    """Refuses inputs beside a function, which returns its own."""
    if inputs is not None:
        raise error(TypeError, f'make the operator "{name}"', "a function that defines a pipeline returns its inputs",
                    "inputs are given too", "Leave them out; `sizes` may be given")


def _identifiers(names):
    """Unique identifiers from names, for the arguments of a schema."""
    made = []
    for name in names:
        word = re.sub(r"\W", "_", name)
        word = word if re.match("[A-Za-z]", word) else "t" + word
        made.append(word if word not in made else f"{word}_{len(made)}")
    return made


def _is_in_range(t, dtype):
    """Whether the integer in a tensor is a value of an integer type. In a trace, which has no values, all of the
    tensor's type must be."""
    held, wanted = torch.iinfo(t.dtype) if t.dtype != torch.bool else None, torch.iinfo(dtype)
    if held is None or (wanted.min <= held.min and held.max <= wanted.max):
        return True
    return not is_compiling() and is_direct((t,)) and wanted.min <= t.item() <= wanted.max


class Operator:
    """An operator of PyTorch; see `operator`. `overload` and `derivative` are those of torch.library."""

    overload = derivative = None

    def __init__(self, name, pipeline, inputs, outputs):
        self._define, self._knows_sizes = None, False
        self.name = name or "without a name"  # until its Funcs are known
        self._outputs = outputs  # used where a definition returns none
        if callable(pipeline) and not isinstance(pipeline, (rg.Func, rg.Pipeline, rg.ImageParam)):
            _check_is_alone(self.name, inputs)
            self._define, self._knows_sizes = pipeline, _takes_shapes(pipeline)
            definition = self._defined(torch.float32)
        else:
            definition = (pipeline, inputs, outputs)
        self._plans, self._sized, self._lock = {}, {}, threading.Lock()
        funcs, self.single = _funcs(self.name, definition[0])
        self._definition = None if self._define else (funcs, self.single, list(definition[1]), outputs)
        self._has_name, self._mark, self._is_restored = bool(name), uuid.uuid4().hex, False
        self.name = name or f"retrograde::{re.sub(r'[^A-Za-z0-9]', '_', funcs[0].name())}_{next(_numbers)}"
        if not re.fullmatch(r"[A-Za-z]\w*::[A-Za-z]\w*", self.name):
            raise error(ValueError, f'make an operator "{self.name}"', 'a name is "namespace::name", of words',
                        "this one is not", "Choose one like that")
        plan = self._plan_of(definition)
        self.results, self.argument_names = len(plan.outputs), _identifiers(plan.names)
        # The index of the tensor whose type selects the definition.
        self._by = next((i for i, d in enumerate(plan.dtypes) if d == torch.float32), None) if self._define else None
        self._plans[torch.float32 if self._by is not None else None] = plan
        self._parameters = plan
        self._numbers = [(i, plan.dtypes[i]) for i, parameter in enumerate(plan.inputs) if not is_image(parameter)]

    def _register(self):
        self._calls = _library.register(self)

    def _signature(self):
        """Properties that distinguish operators of one name: names, types and ranks of inputs, types of results."""
        plan = self._parameters
        return ([(name, str(dtype), rank) for name, dtype, rank in zip(plan.names, plan.dtypes, plan.ranks)],
                [str(dtype) for dtype in plan.result_dtypes])

    # ---- copies and pickles (_pickling.py) ----

    def __copy__(self):
        return self

    def __deepcopy__(self, _):
        return self

    def __reduce__(self):
        return _restored, (self.name if self._has_name else None, self._mark, self._signature(),
                           Function(self._define) if self._define else None,
                           None if self._define else describe(*self._definition),
                           stored_outputs(self._outputs) if self._define else None)

    def _defined(self, dtype):
        """The definition for sizes that are not known."""
        kind = str(dtype)[6:]
        if not self._knows_sizes:
            return _parts(self.name, self._define(kind))
        try:
            return _parts(self.name, self._define(kind, None))
        except (AttributeError, IndexError, TypeError, ValueError) as problem:
            if "NoneType" not in str(problem):
                raise  # sizes play no part
            cause = f"the definition raised {type(problem).__name__}: {problem}"
            rule = ("it is also called with shapes=None, for the names and types of its inputs and for tensors beyond "
                    f"the first {MOST_SIZES} shapes")
            # The cause comes first, because the rule is long.
            made = error(CompileError, f'define the operator "{self.name}" for sizes that are not known', cause, rule,
                         "Where shapes is None, take the sizes from the images: image.dim(0).extent()")
            made.rule, made.evidence = rule, cause
            raise made from problem

    def _plan_of(self, definition, sizes=None):
        pipeline, inputs, outputs = _parts(self.name, definition)
        if outputs is None:
            outputs = self._outputs
        elif outputs is not self._outputs and self._outputs is not None:
            raise error(TypeError, f'make the operator "{self.name}"', "the sizes of its results are given once",
                        "the definition returns them, and operator() was given them", "Leave out one of the two")
        funcs, _ = _funcs(self.name, pipeline)
        return Plan(self.name, funcs, inputs, Sizes(self.name, outputs, inputs, len(funcs)), sizes)

    def plan_for(self, path, tensors):
        """The plan for tensors of these types and, if the definition uses them, sizes."""
        if not self._knows_sizes:
            return self.plan(path, tensors)
        key = [tensors[self._by].dtype if self._by is not None else None]
        for t, rank in zip(tensors, self._parameters.ranks):
            shape = t.shape
            if len(shape) != rank:
                if len(shape) < rank:
                    return self.plan(path, tensors)  # reports the error
                shape = shape[len(shape) - rank:]
            key.append(shape)
        key = tuple(key)
        plan = self._sized.get(key)
        if plan is None:
            generic = self.plan(path, tensors)  # first, because it rejects unsupported types
            generic.check(tensors)
            if any(0 in shape for shape in key[1:]):
                return generic  # there is almost nothing to compute
            with self._lock:
                if key not in self._sized:
                    if len(self._sized) >= MOST_SIZES:
                        return generic
                    sizes = [tuple(size) for size in key[1:]]
                    definition = self._define(str(key[0] or torch.float32)[6:], sizes)
                    self._sized[key] = self._plan_of(definition, sizes)
                plan = self._sized[key]
        return plan.derived(path) if path else plan

    def training_for(self, wanted, tensors):
        """The plans that share values for gradients by these inputs, a bit mask; None without such values, or for a
        batch."""
        plan = self.plan_for((), tensors)
        return None if plan.sizes is None or plan.check(tensors) else training_of(plan, wanted)

    def plan(self, path, tensors):
        """The plan for tensors of these types and of any sizes."""
        dtype = tensors[self._by].dtype if self._by is not None else None
        if dtype is not None and not dtype.is_floating_point:
            dtype = torch.float32  # rejected later
        plan = self._plans.get(dtype)
        if plan is None:
            with self._lock:
                if dtype not in self._plans:
                    self._plans[dtype] = self._plan_of(self._defined(dtype))
                plan = self._plans[dtype]
        return plan.derived(path)

    def __call__(self, *tensors):
        if len(tensors) == len(self.argument_names):
            for i, dtype in self._numbers:  # PyTorch takes an integer wherever it takes a number
                held = getattr(tensors[i], "dtype", dtype)
                if held is not dtype and not (dtype.is_floating_point and getattr(held, "is_floating_point", False)):
                    tensors = self._with_numbers(tensors)
            if not is_compiling() and is_direct(tensors):
                results = self._calls.direct((), tensors)
                return results[0] if self.single else tuple(results)
            for tensor in tensors:
                if not isinstance(tensor, torch.Tensor):
                    return self(*self._as_tensors(tensors))
            return self.overload(*tensors)
        raise error(TypeError, f'call the operator "{self.name}"', f"it takes {', '.join(self.argument_names)}",
                    f"{len(tensors)} arguments are given", "Give one for each")

    def _as_tensors(self, tensors):
        """Converts numbers for Params to tensors."""
        of = next((t.dtype for t in tensors if isinstance(t, torch.Tensor) and t.dtype.is_floating_point), None)
        made = []
        for tensor, dtype, parameter in zip(tensors, self._parameters.dtypes, self._parameters.inputs):
            if not isinstance(tensor, torch.Tensor):
                if is_image(parameter):
                    raise error(TypeError, f'call the operator "{self.name}"', f"{parameter.name()} is a tensor",
                                f"given is a {type(tensor).__name__}", "Make one of it with torch.tensor")
                if isinstance(tensor, float) and not dtype.is_floating_point and not tensor.is_integer():
                    raise error(TypeError, f'call the operator "{self.name}"', f"{parameter.name()} is an integer",
                                f"given is {tensor}", "Round it with int() or round()")
                tensor = torch.tensor(tensor, dtype=self._number_type(dtype, of))
            made.append(tensor)
        return tuple(made)

    def _number_type(self, dtype, of):
        """The type of a number for a Param: `of`, the type of the call, if the definition is a function of it."""
        return of if self._define and dtype == torch.float32 and of else dtype

    def _with_numbers(self, tensors):
        """Converts tensors of one integer to the types of their Params, as PyTorch does: any integer to a floating-point
        type, and to another integer type if it is in its range."""
        of = next((t.dtype for t in tensors if isinstance(t, torch.Tensor) and t.dtype.is_floating_point), None)
        made = list(tensors)
        for i, dtype in self._numbers:
            t, dtype = made[i], self._number_type(dtype, of)
            if not isinstance(t, torch.Tensor) or t.dim() or t.dtype.is_floating_point or t.dtype.is_complex:
                continue
            if dtype.is_floating_point or (dtype != torch.bool and _is_in_range(t, dtype)):
                made[i] = t.to(dtype)
        return tuple(made)

    def explain(self, *inputs):
        """What the operator and its gradients do, as text: the loops of each stage, slowest first, what bounds the
        stage (memory traffic, arithmetic, a serial chain), what is stored or recomputed, and hints.

            print(op.explain((480, 640), (3,)))     # a shape, a tensor or a number for each input
            print(op.explain())                     # inputs like those of the last call

        The gradients are those of the tensors that require them; of shapes, all. Nothing runs: times are predictions of
        the cost model, to compare stages with each other."""
        return explain(self, inputs)

    @property
    def knows_sizes(self):
        """Whether the definition is compiled for each set of sizes."""
        return self._knows_sizes

    def made(self):
        """The paths of the derivatives that exist; see Plan.derived."""
        return sorted({path for plan in [*self._plans.values(), *self._sized.values()] for path in plan.made()})
