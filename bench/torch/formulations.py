"""formulations.py -- the eight operators of definitions.py as PyTorch users write them: by the operators of
torch.nn.functional where available, otherwise by operations on many elements at a time. Those that ../operators
has at other sizes are also its PyTorch programs."""
import torch
import torch.nn.functional as F

PATCH, SEARCH = 3, 5  # for non_local_means
BINS = 8  # for soft_histogram


def _centres(size, like):
    """Positions of pixel centres from -1 to 1, as grid_sample counts them."""
    return (torch.arange(size, dtype=like.dtype, device=like.device) + 0.5) * (2 / size) - 1


def bilateral_slice(image, guide, grid):
    _, height, width = image.shape
    x = _centres(width, image).expand(height, width)
    y = _centres(height, image)[:, None].expand(height, width)
    places = torch.stack([x, y, guide * 2 - 1], -1)[None, None]
    affine = F.grid_sample(grid.flatten(0, 1)[None], places, padding_mode="border", align_corners=False)
    affine = affine.view(3, 4, height, width)
    return (affine[:, :3] * image).sum(1) + affine[:, 3]


def flow_warp(image, flow):
    """Reads the image at each pixel's position plus flow, clamped to the image."""
    _, height, width = image.shape
    x = torch.arange(width, dtype=image.dtype, device=image.device) + flow[0]
    y = torch.arange(height, dtype=image.dtype, device=image.device)[:, None] + flow[1]
    places = torch.stack([x * (2 / max(width - 1, 1)) - 1, y * (2 / max(height - 1, 1)) - 1], -1)
    return F.grid_sample(image[None], places[None], padding_mode="border", align_corners=True)[0]


def spatial_transformer(images, transforms):
    places = F.affine_grid(transforms, images.shape, align_corners=False)
    return F.grid_sample(images, places, align_corners=False)


def convolution(image, weights, bias):
    return F.conv2d(image, weights, bias, padding=1)


def tone_curve(image, curve):
    last = len(curve) - 1
    at = image.clamp(0, 1) * last
    i = at.floor().long().clamp(0, last)
    return torch.lerp(curve[i], curve[(i + 1).clamp(max=last)], at - i)


def recursive_filter(image, mix):
    """Filters along rows, then along columns, by a lower triangular matrix of powers, which needs only one call."""
    def matrix(size):
        i = torch.arange(size, dtype=image.dtype, device=image.device)
        apart = i[:, None] - i
        powers = (1 - mix) ** apart.clamp(min=0)
        first = (i == 0).to(image.dtype)
        return torch.where(apart >= 0, powers * (mix + (1 - mix) * first), powers.new_zeros(()))

    height, width = image.shape
    return matrix(height) @ image @ matrix(width).T


def non_local_means(image, strength, patch=PATCH, search=SEARCH):
    height, width = image.shape
    margin, half = patch // 2, search // 2
    # Patches repeat the same pixels as the search: the edge of the image, at both positions.
    padded = F.pad(image[None, None], [margin + half] * 4, mode="replicate")[0, 0]
    centre = padded[half:padded.shape[0] - half, half:padded.shape[1] - half]
    weights = values = 0
    for dy in range(search):
        for dx in range(search):
            moved = padded[dy:dy + centre.shape[0], dx:dx + centre.shape[1]]
            distance = F.avg_pool2d(((centre - moved) ** 2)[None, None], patch, 1)[0, 0]
            weight = torch.exp(-strength * distance)
            weights = weights + weight
            values = values + weight * moved[margin:margin + height, margin:margin + width]
    return values / weights


def soft_histogram(image):
    at = (image.clamp(0, 1) * (BINS - 1)).flatten()
    i = at.detach().floor().long().clamp(0, BINS - 1)
    w = at - i
    zeros = torch.zeros(BINS, dtype=image.dtype, device=image.device)
    return zeros.index_add(0, i, 1 - w).index_add(0, (i + 1).clamp(max=BINS - 1), w)


FORMULATIONS = {f.__name__: f for f in (bilateral_slice, flow_warp, spatial_transformer, convolution, tone_curve,
                                        recursive_filter, non_local_means, soft_histogram)}
