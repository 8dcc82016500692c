"""definitions.py -- eight PyTorch operators as pipelines, for tests and for `tools/bench torch`.

Each is a function of an element type, and of the tensors' shapes if they are known. It returns what
retrograde.torch.operator takes: the output, its inputs, and the output's sizes computed from the tensors. Dimensions
are in the order of Funcs, innermost first. formulations.py has PyTorch's versions, with dimensions in reverse order.
"""
import retrograde as rg
from formulations import BINS, PATCH, SEARCH

x, y, c, n = (rg.Var(name) for name in "xycn")


def _image(kind, dimensions, name, shape):
    """An image, and its sizes: numbers where they are known."""
    image = rg.ImageParam(kind, dimensions, name)
    return image, list(reversed(shape)) if shape else [image.dim(d).extent() for d in range(dimensions)]


def _known(shapes, count):
    return shapes or [None] * count


def _of(kind, value):
    return rg.cast(kind, value)


def _cell(kind, place, count):
    """The two knots next to a position from 0 to count - 1, and its distance from the first one."""
    near = rg.clamp(rg.cast("int32", rg.floor(place)), 0, count - 1)
    return near, rg.min(near + 1, count - 1), place - _of(kind, near)


def _bilinear(kind, image, sizes, u, v, rest):
    """image(u, v, rest...) interpolated between its pixels; positions must lie inside the image."""
    i, right, wx = _cell(kind, u, sizes[0])
    j, below, wy = _cell(kind, v, sizes[1])
    above = image[(i, j, *rest)] + wx * (image[(right, j, *rest)] - image[(i, j, *rest)])
    under = image[(i, below, *rest)] + wx * (image[(right, below, *rest)] - image[(i, below, *rest)])
    return above + wy * (under - above)


def bilateral_slice(kind, shapes=None):
    """A grid of affine maps, sliced by position and by a guide, applied to the pixels.
    Source: Gharbi et al., Deep Bilateral Learning for Real-Time Image Enhancement, SIGGRAPH 2017, section 3.3."""
    of_image, of_guide, of_grid = _known(shapes, 3)
    image, image_sizes = _image(kind, 3, "image", of_image)
    guide, _ = _image(kind, 2, "guide", of_guide)
    grid, (width, height, levels, _, _) = _image(kind, 5, "grid", of_grid)
    k, depth, coefficients, sliced = rg.Var("k"), rg.Func("depth"), rg.Func("coefficients"), rg.Func("sliced")

    def place(at, size, cells):
        cells = _of(kind, cells)
        return rg.clamp((_of(kind, at) + 0.5) * (cells / _of(kind, size)) - 0.5, _of(kind, 0), cells - 1)

    depth[x, y] = rg.clamp(guide[x, y] * _of(kind, levels) - 0.5, _of(kind, 0), _of(kind, levels) - 1)
    i, right, wx = _cell(kind, place(x, image_sizes[0], width), width)
    j, below, wy = _cell(kind, place(y, image_sizes[1], height), height)
    l, behind, wz = _cell(kind, depth[x, y], levels)

    def level(z):
        above = rg.lerp(grid[i, j, z, k, c], grid[right, j, z, k, c], wx)
        return rg.lerp(above, rg.lerp(grid[i, below, z, k, c], grid[right, below, z, k, c], wx), wy)

    coefficients[x, y, k, c] = rg.lerp(level(l), level(behind), wz)
    total = coefficients[x, y, 3, c]
    for channel in range(3):
        total = total + coefficients[x, y, channel, c] * image[x, y, channel]
    sliced[x, y, c] = total
    return sliced, [image, guide, grid], lambda image, guide, grid: list(reversed(image.shape[-3:]))


def flow_warp(kind, shapes=None):
    """Reads an image at each pixel's position plus flow, clamped to the image."""
    of_image, of_flow = _known(shapes, 2)
    (image, sizes), (flow, _) = _image(kind, 3, "image", of_image), _image(kind, 3, "flow", of_flow)
    u, v, warped = rg.Func("u"), rg.Func("v"), rg.Func("warped")
    last = [_of(kind, size - 1) for size in sizes[:2]]
    u[x, y] = rg.clamp(_of(kind, x) + flow[x, y, 0], _of(kind, 0), last[0])
    v[x, y] = rg.clamp(_of(kind, y) + flow[x, y, 1], _of(kind, 0), last[1])
    warped[x, y, c] = _bilinear(kind, image, sizes, u[x, y], v[x, y], (c,))
    return warped, [image, flow], lambda image, flow: [flow.shape[2], flow.shape[1], image.shape[0]]


def spatial_transformer(kind, shapes=None):
    """Images under affine maps, with zeros outside.
    Source: Jaderberg et al., Spatial Transformer Networks, NeurIPS 2015."""
    of_images, of_transforms = _known(shapes, 2)
    images, (width, height, _, _) = _image(kind, 4, "images", of_images)
    transforms, _ = _image(kind, 3, "transforms", of_transforms)
    u, v, transformed = rg.Func("u"), rg.Func("v"), rg.Func("transformed")
    across, down = ((_of(kind, 2 * at + 1) / _of(kind, size) - 1) for at, size in ((x, width), (y, height)))

    def place(row, size):
        at = transforms[0, row, n] * across + transforms[1, row, n] * down + transforms[2, row, n]
        return ((at + 1) * _of(kind, size) - 1) * 0.5

    u[x, y, n] = place(0, width)
    v[x, y, n] = place(1, height)
    padded = rg.BoundaryConditions.constant_exterior(images, _of(kind, 0), [(0, width), (0, height)])
    i = rg.clamp(rg.cast("int32", rg.floor(u[x, y, n])), -2, width)
    j = rg.clamp(rg.cast("int32", rg.floor(v[x, y, n])), -2, height)
    wx, wy = u[x, y, n] - rg.floor(u[x, y, n]), v[x, y, n] - rg.floor(v[x, y, n])
    transformed[x, y, c, n] = rg.lerp(rg.lerp(padded[i, j, c, n], padded[i + 1, j, c, n], wx),
                                      rg.lerp(padded[i, j + 1, c, n], padded[i + 1, j + 1, c, n], wx), wy)
    return transformed, [images, transforms], lambda images, transforms: list(reversed(images.shape[-4:]))


def convolution(kind, shapes=None):
    """3 x 3 convolution with bias and zero padding."""
    of_image, of_weights, of_bias = _known(shapes, 3)
    image, sizes = _image(kind, 4, "image", of_image)
    (weights, _), (bias, _) = _image(kind, 4, "weights", of_weights), _image(kind, 1, "bias", of_bias)
    padded = rg.BoundaryConditions.constant_exterior(image, _of(kind, 0), [(0, size) for size in sizes])
    r, convolved = rg.RDom([(0, 3), (0, 3), (0, sizes[2])]), rg.Func("convolved")
    convolved[x, y, c, n] = bias[c]
    convolved[x, y, c, n] += weights[r.x, r.y, r.z, c] * padded[x + r.x - 1, y + r.y - 1, r.z, n]
    return convolved, [image, weights, bias], lambda image, weights, bias: [
        image.shape[3], image.shape[2], weights.shape[0], image.shape[0]]


def tone_curve(kind, shapes=None):
    """Maps each pixel's value through a curve with equidistant knots from 0 to 1."""
    of_image, of_curve = _known(shapes, 2)
    (image, _), (curve, (knots,)) = _image(kind, 2, "image", of_image), _image(kind, 1, "curve", of_curve)
    toned = rg.Func("toned")
    i, after, w = _cell(kind, rg.clamp(image[x, y], _of(kind, 0), _of(kind, 1)) * _of(kind, knots - 1), knots)
    toned[x, y] = rg.lerp(curve[i], curve[after], w)
    return toned, [image, curve], None


def recursive_filter(kind, shapes=None):
    """A recursive filter along both directions of an image; the mixing weight is a number."""
    image, sizes = _image(kind, 2, "image", _known(shapes, 1)[0])
    mix, filtered = rg.Param(kind, "mix"), rg.Func("filtered")
    across, down = (rg.RDom([(1, size - 1)]) for size in sizes)
    rows = rg.Func("rows")
    rows[x, y] = image[x, y]
    rows[across, y] = mix * rows[across, y] + (1 - mix) * rows[across - 1, y]
    filtered[x, y] = rows[x, y]
    filtered[x, down] = mix * filtered[x, down] + (1 - mix) * filtered[x, down - 1]
    return filtered, [image, mix], None


def non_local_means(kind, shapes=None):
    """Each pixel is a mean over a window, weighted by the similarity of the patches around both pixels.
    Source: Buades, Coll and Morel, A Non-Local Algorithm for Image Denoising, CVPR 2005."""
    (image, sizes), strength = _image(kind, 2, "image", _known(shapes, 1)[0]), rg.Param(kind, "strength")
    dx, dy, f = rg.Var("dx"), rg.Var("dy"), rg.BoundaryConditions.repeat_edge(image, [(0, size) for size in sizes])
    p, s = rg.RDom([(-(PATCH // 2), PATCH)]), rg.RDom([(-(SEARCH // 2), SEARCH)] * 2)
    names = ("difference", "across", "distance", "weight", "weights", "values", "denoised")
    difference, across, distance, weight, weights, values, denoised = (rg.Func(name) for name in names)
    apart = f[x, y] - f[x + dx, y + dy]
    difference[x, y, dx, dy] = apart * apart
    across[x, y, dx, dy] = _of(kind, 0)
    across[x, y, dx, dy] += difference[x + p, y, dx, dy]
    distance[x, y, dx, dy] = _of(kind, 0)
    distance[x, y, dx, dy] += across[x, y + p, dx, dy]
    weight[x, y, dx, dy] = rg.exp(-strength * distance[x, y, dx, dy] * (1 / PATCH**2))
    weights[x, y] = _of(kind, 0)
    weights[x, y] += weight[x, y, s.x, s.y]
    values[x, y] = _of(kind, 0)
    values[x, y] += weight[x, y, s.x, s.y] * f[x + s.x, y + s.y]
    denoised[x, y] = values[x, y] / weights[x, y]
    return denoised, [image, strength], None


def soft_histogram(kind, shapes=None):
    """A soft histogram of values from 0 to 1: each pixel counts for its two nearest bins."""
    (image, sizes), histogram = _image(kind, 2, "image", _known(shapes, 1)[0]), rg.Func("histogram")
    r = rg.RDom([(0, sizes[0]), (0, sizes[1])])
    i, after, w = _cell(kind, rg.clamp(image[r.x, r.y], _of(kind, 0), _of(kind, 1)) * (BINS - 1), BINS)
    histogram[x] = _of(kind, 0)
    histogram[i] += 1 - w
    histogram[after] += w
    return histogram, [image], lambda image: [BINS]


OPERATORS = {f.__name__: f for f in (bilateral_slice, flow_warp, spatial_transformer, convolution, tone_curve,
                                     recursive_filter, non_local_means, soft_histogram)}
