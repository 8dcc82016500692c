"""Errors about reads outside of tensors, in terms of the tensors.

A pipeline that is compiled for known sizes promises them, and its checks report promises. The user of an operator made
none, but gave tensors and asked for sizes of results.
"""
import re

from .._errors import RuntimeError, error
from .._explain import plain

_PROMISED = re.compile(r'"([^"]+)" is used over \[(-?\d+), (-?\d+)\] in dimension (\d+), but its min is promised')


class naming_tensors:
    """Around a call of a plan: turns errors about promises into errors about tensors."""

    def __init__(self, plan, tensors, results):
        self._call = plan, tensors, results

    def __enter__(self):
        pass

    def __exit__(self, kind, problem, _):
        better = _reading_outside(problem, *self._call) if isinstance(problem, RuntimeError) else None
        if better is not None:
            raise better from None


def _reading_outside(problem, plan, tensors, results):
    """The error to raise instead of `problem`; None if that is about something else."""
    found = _PROMISED.search(str(problem))
    if not found:
        return None
    name, low, high, d = plain(found[1]), int(found[2]), int(found[3]), int(found[4])
    inputs = dict(zip(map(plain, plan.names), tensors))
    t = {**dict(zip((plain(f.name()) for f in plan.outputs), results)), **inputs}.get(name)
    if t is None:
        return None
    size, wrong = t.shape[-1 - d], low if low < 0 else high
    axis = f"dimension {d} (axis {t.dim() - 1 - d} of the tensor)" if t.dim() > 1 else f"dimension {d}"
    if name in inputs:
        rule, advice = "a pipeline reads only elements that its tensors have", \
            "Ask for smaller results (`sizes`), clamp the index, or read the image through rg.BoundaryConditions"
    else:
        rule, advice = "updates read only elements that the result has", \
            "Start the RDom of the update where its reads lie inside, or let another Func read this one, and return that"
    made = error(RuntimeError, f'call the operator "{plan.name}"', rule,
                 f'"{name}" has {size} element{"s" * (size != 1)} along {axis}, and index {wrong} is read', advice)
    made.code = problem.code
    return made
