"""The slicing layer in two versions: as an operator made from a pipeline, and in plain PyTorch.

    sliced[c](x, y) = sum over k of A[c, k](x, y, guide(x, y)) (image, 1)[k](x, y)

A: a grid of affine maps of colours over position and brightness, read between its cells.
image [n, 3, height, width], guide [n, height, width] from 0 to 1, grid [n, 3, 4, levels, cells, cells].
Source: Gharbi et al., Deep Bilateral Learning for Real-Time Image Enhancement, SIGGRAPH 2017, section 3.3."""
import retrograde as rg
import torch
import torch.nn.functional as F
from retrograde.torch import operator

x, y, k, c = (rg.Var(name) for name in "xykc")


def _pipeline(kind, shapes):
    """The pipeline for one image; the operator handles batches."""
    image, guide, grid = rg.ImageParam(kind, 3, "image"), rg.ImageParam(kind, 2, "guide"), rg.ImageParam(kind, 5, "grid")
    if shapes:
        (_, height, width), _, (_, _, levels, rows, columns) = shapes
    else:
        width, height = image.dim(0).extent(), image.dim(1).extent()
        columns, rows, levels = (grid.dim(d).extent() for d in range(3))

    def real(value):
        return rg.cast(kind, value)

    def cells(place, count):
        """The two cells next to a position, clamped to the grid, and the distance from the first one."""
        place = rg.clamp(place, real(0), real(count) - 1)
        near = rg.clamp(rg.cast("int32", rg.floor(place)), 0, count - 1)
        return near, rg.min(near + 1, count - 1), place - real(near)

    depth, maps, sliced = rg.Func("depth"), rg.Func("maps"), rg.Func("sliced")
    depth[x, y] = guide[x, y] * real(levels) - 0.5
    i, right, wx = cells((real(x) + 0.5) * (real(columns) / real(width)) - 0.5, columns)
    j, below, wy = cells((real(y) + 0.5) * (real(rows) / real(height)) - 0.5, rows)
    l, behind, wz = cells(depth[x, y], levels)

    def level(z):
        return rg.lerp(rg.lerp(grid[i, j, z, k, c], grid[right, j, z, k, c], wx),
                       rg.lerp(grid[i, below, z, k, c], grid[right, below, z, k, c], wx), wy)

    maps[x, y, k, c] = rg.lerp(level(l), level(behind), wz)
    total = maps[x, y, 3, c]
    for channel in range(3):
        total = total + maps[x, y, channel, c] * image[x, y, channel]
    sliced[x, y, c] = total
    return sliced, [image, guide, grid]


slice_by_pipeline = operator("learned_retouching::slice", _pipeline)


def slice_by_pytorch(image, guide, grid):
    n, _, height, width = image.shape
    across = ((torch.arange(width, dtype=image.dtype) + 0.5) * (2 / width) - 1).expand(n, height, width)
    down = ((torch.arange(height, dtype=image.dtype) + 0.5) * (2 / height) - 1)[:, None].expand(n, height, width)
    places = torch.stack([across, down, guide * 2 - 1], -1)[:, None]
    maps = F.grid_sample(grid.flatten(1, 2), places, padding_mode="border", align_corners=False)
    maps = maps.view(n, 3, 4, height, width)
    return (maps[:, :, :3] * image[:, None]).sum(2) + maps[:, :, 3]
