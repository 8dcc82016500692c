"""Operator.explain(): the stages of an operator and of its gradients, in plain words (see retrograde.explain)."""
import math

import torch

from .. import _explain
from .. import _retrograde as rg
from .._errors import CompileError, Error, error
from ._device import device_of
from ._plan import GRADIENT, bits
from ._training import training_of

# The facts about a gradient that a reader needs, by the names of Explanation.Kind.
_FACTS = {"Scattered": " is a sum at data-dependent indices", "Privatised": "", "Zero": " is zero", "Version": "",
          "Performance": ""}


def explain(operator, given):
    """The text of Operator.explain."""
    tensors, wanted = _tensors(operator, given) if given else _last_call(operator)
    plan = operator.plan_for((), tensors)
    batch = plan.batch(tensors) if plan.check(tensors) else ()
    results = [tuple(shape)[len(batch):] for shape in plan.shapes(tensors, batch)]
    kinds = [(t.dtype, tuple(t.shape)[t.dim() - rank:], t.device) for t, rank in zip(tensors, plan.ranks)]
    lines = [f"{operator.name}({', '.join(map(_shown, plan.names, kinds))})"
             + (f", called for each of a batch of {list(batch)}" if batch else "")]
    forward, notes = _pipeline(plan, kinds, results), []
    lines += forward[:1] + ["forward: " + forward[1], *forward[2:]]
    wanted = [i for i in wanted if plan.dtypes[i].is_floating_point]
    seeds = [i for i, dtype in enumerate(plan.result_dtypes) if dtype.is_floating_point]
    if wanted and seeds:
        title = f"backward, gradients of {' and '.join(plan.names[i] for i in wanted)}: "
        try:
            step = GRADIENT, sum(1 << i for i in wanted), sum(1 << i for i in seeds)
            place = kinds[0][2] if kinds else torch.device("cpu")
            training = training_of(plan, step[1]) if place.type in ("cpu", "meta") else None
            residuals = [(*kind, place) for kind in training.residual_kinds()] if training else []
            gradient = training.backward if training else plan.derived(step)
            every = kinds + residuals + [(plan.result_dtypes[i], results[i], place) for i in seeds]
            backward = _pipeline(gradient, every, [kinds[i][1] for i in wanted])
            lines += [title + backward[1], *backward[2:], *_kept(training)]
            notes = _facts(gradient.facts(), {plan.names[i] for i in wanted})
        except Error as problem:
            lines.append(title + str(problem))
    return "\n".join(lines + notes) + "\n"


def _shown(name, kind):
    dtype, shape, _ = kind
    return f"{name}: {str(dtype)[6:]} {list(shape)}"


def _last_call(operator):
    """Tensors like those of the last call, and the positions of the inputs whose gradients were last asked for."""
    seen = operator._calls.seen
    if () not in seen:
        raise error(CompileError, f'explain the operator "{operator.name}"',
                    "sizes are given, or those of the last call", "it has not been called", "Give a shape or a tensor for each input: op.explain((480, 640), (3,))")
    tensors = [torch.empty(shape, dtype=dtype, device="meta") for dtype, shape in seen[()]]
    gradients = [path for path in seen if len(path) == 3 and path[0] == GRADIENT]
    return tensors, bits(gradients[-1][1]) if gradients else range(len(tensors))


def _tensors(operator, given):
    """Tensors for the arguments of explain(), and the positions of the inputs to differentiate by."""
    known = operator._parameters
    if len(given) != len(known.inputs):
        raise error(TypeError, f'explain the operator "{operator.name}"',
                    f"it takes a shape, a tensor or a number for each of {', '.join(known.names)}",
                    f"{len(given)} are given", "Give one for each, or none for those of the last call")
    tensors = []
    for one, dtype in zip(given, known.dtypes):
        if isinstance(one, (list, tuple)):
            one = torch.empty(tuple(one), dtype=dtype, device="meta")
        tensors.append(one if isinstance(one, torch.Tensor) else torch.tensor(one, dtype=dtype))
    wanted = [i for i, t in enumerate(tensors) if t.requires_grad]
    return tensors, wanted or range(len(tensors))


def _pipeline(plan, kinds, results):
    """Lines about one pipeline: the machine, the time of all stages, the stages."""
    sizes = [list(reversed(shape)) for shape in results]
    images = {name: list(reversed(shape)) for name, (_, shape, _) in zip(plan.names, kinds) if shape}
    pipeline = rg.Pipeline(plan.outputs)
    places = [place for _, _, place in kinds if place.type not in ("cpu", "meta")]
    if places:
        target = rg.Target(device_of(places[0]).target)
        kernels = rg.explain_kernels(pipeline._scheduled_copy(target), target)
        return [f"Times of kernels on {places[0]} are not predicted.", f"{len(kernels.kernels)} kernels",
                *("  " + line for line in str(kernels).splitlines())]
    found = _explain.stages_of(pipeline, sizes, images)
    return [_explain.machine_line(found), f"{found['ms']:.3g} ms", *_explain.lines(found)]


def _kept(training):
    """A line about the values that the gradient does not recompute."""
    if training is None:
        return []
    names = sorted({_explain.plain(f.name()) for f in training.residuals})
    size = sum(math.prod(shape) * torch.finfo(dtype).bits // 8 for dtype, shape in training.residual_kinds())
    shown = ", ".join(names[:_explain.MOST_STAGES])
    return [f"  kept by the forward pass for the gradient, {_explain.size_of(size)}: {shown}"]


def _facts(explanations, wanted):
    """Lines about the sums of a gradient, each once. A zero counts if it is the gradient of an input that is wanted."""
    lines = []
    for fact in explanations:
        words = _FACTS.get(fact.kind.name)
        if words is None or "without a directive" in fact.detail:
            continue
        if fact.kind.name == "Zero" and fact.subject not in wanted:
            continue
        line = f'  the gradient of "{_explain.plain(fact.subject)}"{words}: {_explain.plain(fact.detail)}'
        if line not in lines:
            lines.append(line)
    return lines[:_explain.MOST_STAGES]
