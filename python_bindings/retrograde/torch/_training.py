"""A forward pass that hands values to its gradient, so that the gradient does not recompute them.

    forward(inputs) -> results, residuals          backward(inputs, residuals, seeds) -> gradients

Residuals are sums and maxima of many terms that the gradient reads: means, variances, normalisations. A pass over all
inputs computes them, and they take little memory. compiler/autodiff/sweeps/residuals.h chooses them. They exist for
operators that know the sizes of their inputs, for one set of inputs to differentiate by and all outputs.
"""
import itertools
import threading

from .. import _retrograde as rg
from .._errors import Error
from .._explain import plain
from ._plan import GRADIENT, Plan, func_as

_lock, _numbers = threading.RLock(), itertools.count()


class Training:
    """The plans of a forward pass and of its gradient, whose path is `step`. The forward pass returns the results and
    then the residuals; the gradient takes the inputs, the residuals and the seeds."""

    def __init__(self, step, forward, backward, residuals):
        self.step, self.forward, self.backward, self.residuals = step, forward, backward, residuals
        self.results = len(forward.outputs) - len(residuals)
        self._is_usable = True

    def residual_kinds(self):
        """The types and shapes of the residuals."""
        first = len(self.forward.inputs)
        last = first + len(self.residuals)
        return list(zip(self.backward.dtypes[first:last], self.backward.sizes[first:last]))

    def run_forward(self, tensors):
        """The results, and the residuals. None if the call fails: the operator then runs as without residuals, and
        reports what is wrong."""
        return self._run(self.forward, tensors)

    def run_backward(self, tensors, residuals, seeds):
        """The gradients, or None as above."""
        return self._run(self.backward, (*tensors, *residuals, *seeds))

    def _run(self, plan, tensors):
        if self._is_usable:
            try:
                expected = plan.expected  # faster, and None for other sizes
                results = expected(tensors) if expected is not None else None
                return plan.run(tensors) if results is None else results
            except Error:
                self._is_usable = False
        return None


def training_of(plan, wanted):
    """The Training of a plan by a set of inputs, a bit mask; None if nothing is worth keeping."""
    given = sum(1 << i for i, dtype in enumerate(plan.result_dtypes) if dtype.is_floating_point)
    step = GRADIENT, wanted, given
    if plan.sizes is None or not wanted or not given:
        return None
    with _lock:
        if step not in plan.trainings:
            plan.trainings[step] = _new_training(plan, step)
        return plan.trainings[step]


def _new_training(plan, step):
    try:
        if not rg._may_have_residuals(plan.outputs):
            return None
        gradient = plan.derived(step)
        found = rg._residuals(plan.outputs, gradient.outputs)
    except Error:  # the gradient reports it, if it is called
        return None
    if not found:
        return None
    kept = [f for f, _ in found]
    shapes = [tuple(reversed(extents)) for _, extents in found]
    results, count = plan.shapes((), ()), len(plan.inputs)
    # Copies, because an output has to be stored as a whole before another one reads it.
    copies = [func_as(f.type(), f.dimensions(), f"kept_{plain(f.name())}", f) for f in kept]
    forward = Plan(f"{plan.name}, with residuals", plan.outputs + copies, plan.inputs,
                   lambda _: [*results, *shapes], plan.sizes)
    images = [rg.ImageParam(f.type(), f.dimensions(), f"{plain(f.name())}_kept_{next(_numbers)}") for f in kept]
    backward = Plan(gradient.name, rg._reading_residuals(gradient.outputs, kept, images),
                    [*plan.inputs, *images, *gradient.inputs[count:]],
                    lambda tensors: [tuple(tensors[i].shape) for i in gradient.wanted],
                    [*plan.sizes, *shapes, *gradient.sizes[count:]])
    backward.facts = gradient.facts
    return Training(step, forward, backward, kept)
