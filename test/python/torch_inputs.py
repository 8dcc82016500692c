"""Tensors for the eight operators of bench/torch/definitions.py."""
import torch


def values(*shape, low=0.0, high=1.0, kind=torch.float64, seed=1):
    generator = torch.Generator().manual_seed(seed)
    return (low + (high - low) * torch.rand(shape, generator=generator, dtype=torch.float64)).to(kind)


def off_grid(t, cells):
    """Not at the kinks of what is linear between `cells` knots: finite differences see one side alone there."""
    at = t * cells
    return (at.floor() + (at - at.floor()) * 0.8 + 0.1) / cells


# SHAPES: the sizes of the operators' tensors, with names for free sizes. READ: the names of sizes that cannot be 0,
# because an element is read in any case: by a gather, or at the edge of an image.
SHAPES = {
    "bilateral_slice": [(3, "H", "W"), ("H", "W"), (3, 4, "levels", "cells", "columns")],
    "flow_warp": [("C", "H", "W"), (2, "H", "W")],
    "spatial_transformer": [("N", "C", "H", "W"), ("N", 2, 3)],
    "convolution": [("N", "in", "H", "W"), ("out", "in", 3, 3), ("out",)],
    "tone_curve": [("H", "W"), ("knots",)],
    "recursive_filter": [("H", "W"), ()],
    "non_local_means": [("H", "W"), ()],
    "soft_histogram": [("H", "W")],
}
READ = ("levels", "cells", "columns", "knots", "in")


def sizes_of(name):
    """Sizes for each free axis: all 1, and each axis 0, 1 and 2 where the others are 3."""
    axes = sorted({axis for shape in SHAPES[name] for axis in shape if isinstance(axis, str)})
    yield dict.fromkeys(axes, 1)
    for axis in axes:
        for size in (1, 2) if axis in READ else (0, 1, 2):
            yield {**dict.fromkeys(axes, 3), axis: size}


def inputs_of_sizes(name, sizes, kind=torch.float64):
    """Of the operator of that name; values at which it is smooth."""
    shapes = [tuple(sizes.get(axis, axis) for axis in shape) for shape in SHAPES[name]]
    made = [0.11 + 0.77 * values(*shape, seed=i + 1, kind=kind) for i, shape in enumerate(shapes)]
    if name == "bilateral_slice":
        made[1] = off_grid(made[1] * 0.9 + 0.05, sizes["levels"])
    if name == "tone_curve":
        made[0] = off_grid(made[0], max(sizes["knots"] - 1, 1))
    if name == "soft_histogram":
        made[0] = off_grid(made[0], 7)
    return made


def inputs_of(name, kind=torch.float64):
    """Of the operator of that name, of the smallest size at which everything happens that can happen."""
    transforms = torch.tensor([[[0.83, -0.21, 0.11], [0.17, 0.93, -0.07]], [[1.07, 0.05, -0.03], [-0.12, 0.71, 0.2]]])
    made = {
        "bilateral_slice": lambda: (values(3, 3, 4), off_grid(values(3, 4, seed=2) * 0.9 + 0.05, 3),
                                    values(3, 4, 3, 2, 2, low=-1)),
        "flow_warp": lambda: (values(2, 3, 4, low=-1), off_grid(values(2, 3, 4, low=-2, high=2, seed=2), 1)),
        "spatial_transformer": lambda: (values(2, 2, 4, 3, low=-1), transforms.double()),
        "convolution": lambda: (values(2, 2, 3, 4, low=-1), values(3, 2, 3, 3, low=-1), values(3)),
        "tone_curve": lambda: (off_grid(values(3, 5), 3), values(4, low=-1, seed=2)),
        "recursive_filter": lambda: (values(4, 5), torch.tensor(0.4, dtype=torch.float64)),
        "non_local_means": lambda: (values(4, 5), torch.tensor(3.0, dtype=torch.float64)),
        "soft_histogram": lambda: (off_grid(values(3, 4), 7),),
    }[name]()
    return tuple(t.to(kind) for t in made)
