#!/usr/bin/env python3
"""torch_programs.py -- makes one operator of bench/torch or bench/outside and runs it forward and backward once.

    torch_programs.py PACKAGE torch|outside NAME

For programs.py, which keeps the graphs that are scheduled on the way.
"""
import sys
from pathlib import Path

BENCH = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(BENCH / "torch"), str(BENCH / "outside")]
import sides  # noqa: E402


def case_of(group, name):
    """The maker of an operator, its inputs in float64, and the positions of those without a gradient."""
    from retrograde.torch import operator

    if group == "outside":
        from programs import PROGRAMS

        program = PROGRAMS[name]
        inputs = program.inputs(sides.uniform(11), False)
        shapes = [tuple(t.shape) for t in inputs]
        return program.operator(shapes, "outside"), inputs, program.constants
    import bench
    from definitions import OPERATORS

    return operator(f"bench::{name}", OPERATORS[name]), bench.sized(False)[name], ()


def main():
    status = sides.run_in_peers(2)
    if status is not None:
        sys.exit(status)
    package, group, name = sys.argv[1:]
    sides.prepare(package, 2)
    import torch

    function, inputs, constants = case_of(group, name)
    tensors = [t.float() if t.is_floating_point() else t for t in inputs]
    wanted = [t.requires_grad_() for i, t in enumerate(tensors) if t.is_floating_point() and i not in constants]
    results = sides.as_list(function(*tensors))
    torch.autograd.grad(results, wanted, [torch.ones_like(t) for t in results])


if __name__ == "__main__":
    main()
