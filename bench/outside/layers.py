"""layers.py -- layers of neural networks, each with its activation."""
import math

import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

x, y, c, n, t, d, h, w = (rg.Var(name) for name in "xycntdhw")


class GroupNorm(Program):
    """Normalisation over eight groups of channels, with scale, shift and the activation x / (1 + exp(-x)).
    Source: Wu and He, Group normalization, ECCV 2018."""

    GROUPS = 8

    def inputs(values, small):
        batch, channels, size = (2, 16, 6) if small else (8, 64, 64)
        return values(batch, channels, size, size, low=-1, high=2), values(channels, low=0.5), values(channels, low=-1)

    def define(of_features, *_):
        batch, channels, height, width = of_features
        features = rg.ImageParam("float32", 4, "features")
        scale, shift = rg.ImageParam("float32", 1, "scale"), rg.ImageParam("float32", 1, "shift")
        group = channels // GroupNorm.GROUPS
        r, count = rg.RDom([(0, width), (0, height), (0, group)]), width * height * group
        mean, variance, normalised, active = (rg.Func(name) for name in ("mean", "variance", "normalised", "active"))
        mean[c, n] = 0.0
        mean[c, n] += features[r.x, r.y, c * group + r.z, n] / count
        apart = features[r.x, r.y, c * group + r.z, n] - mean[c, n]
        variance[c, n] = 0.0
        variance[c, n] += apart * apart / count
        of_group = c // group
        normalised[x, y, c, n] = (scale[c] * (features[x, y, c, n] - mean[of_group, n])
                                  / rg.sqrt(variance[of_group, n] + 1e-5) + shift[c])
        active[x, y, c, n] = normalised[x, y, c, n] / (1 + rg.exp(-normalised[x, y, c, n]))
        return active, [features, scale, shift], [width, height, channels, batch]

    def pytorch(features, scale, shift):
        return F.silu(F.group_norm(features, GroupNorm.GROUPS, scale, shift))


class TransposedConvolution(Program):
    """Doubles the size of feature maps by a 4 x 4 convolution of the maps with zeros between their elements.
    Source: Radford, Metz and Chintala, Unsupervised representation learning with DCGANs, ICLR 2016."""

    def inputs(values, small):
        batch, channels, filters, size = (2, 3, 4, 5) if small else (4, 64, 32, 48)
        return values(batch, channels, size, size, low=-1), \
            values(channels, filters, 4, 4, low=-0.1, high=0.1), values(filters)

    def define(of_features, of_weights, _):
        (batch, channels, height, width), filters = of_features, of_weights[1]
        features, weights = rg.ImageParam("float32", 4, "features"), rg.ImageParam("float32", 4, "weights")
        bias, spread, doubled = rg.ImageParam("float32", 1, "bias"), rg.Func("spread"), rg.Func("doubled")
        padded = rg.BoundaryConditions.constant_exterior(features, 0.0, [(0, width), (0, height)])
        spread[x, y, c, n] = rg.select((x % 2 == 0) & (y % 2 == 0), padded[x // 2, y // 2, c, n], 0.0)
        r = rg.RDom([(0, 4), (0, 4), (0, channels)])
        doubled[x, y, c, n] = bias[c]
        doubled[x, y, c, n] += spread[x + 1 - r.x, y + 1 - r.y, r.z, n] * weights[r.x, r.y, c, r.z]
        return doubled, [features, weights, bias], [2 * width, 2 * height, filters, batch]

    def pytorch(features, weights, bias):
        return F.conv_transpose2d(features, weights, bias, stride=2, padding=1)


class DilatedGate(Program):
    """A causal convolution over time with holes of eight samples, one half of whose channels gates the other.
    Source: van den Oord et al., WaveNet: a generative model for raw audio, 2016, equation 2."""

    DILATION = 8

    def inputs(values, small):
        batch, channels, samples = (2, 4, 40) if small else (4, 32, 8192)
        return values(batch, channels, samples, low=-1), values(2 * channels, channels, 3, low=-0.2, high=0.2), \
            values(2 * channels, low=-0.1, high=0.1)

    def define(of_sound, *_):
        batch, channels, samples = of_sound
        sound, weights = rg.ImageParam("float32", 3, "sound"), rg.ImageParam("float32", 3, "weights")
        bias, mixed, gated = rg.ImageParam("float32", 1, "bias"), rg.Func("mixed"), rg.Func("gated")
        padded = rg.BoundaryConditions.constant_exterior(sound, 0.0, [(0, samples)])
        r = rg.RDom([(0, 3), (0, channels)])
        mixed[t, c, n] = bias[c]
        mixed[t, c, n] += weights[r.x, r.y, c] * padded[t - DilatedGate.DILATION * (2 - r.x), r.y, n]
        gated[t, c, n] = rg.tanh(mixed[t, c, n]) / (1 + rg.exp(-mixed[t, c + channels, n]))
        return gated, [sound, weights, bias], [samples, channels, batch]

    def pytorch(sound, weights, bias):
        padded = F.pad(sound, (2 * DilatedGate.DILATION, 0))
        values, gates = F.conv1d(padded, weights, bias, dilation=DilatedGate.DILATION).chunk(2, 1)
        return torch.tanh(values) * torch.sigmoid(gates)


class WindowedAttention(Program):
    """Causal attention of each position to the 64 last ones, with a learned bias for each distance.
    Source: Beltagy, Peters and Cohan, Longformer, 2020; the bias: Raffel et al., T5, JMLR 2020."""

    def inputs(values, small):
        heads, length, depth, window = (2, 10, 4, 3) if small else (4, 2048, 32, 64)
        return *(values(heads, length, depth, low=-1) for _ in range(3)), values(heads, window, low=-1)

    def define(of_queries, _, __, of_bias):
        (heads, length, depth), (_, window) = of_queries, of_bias
        queries, keys, values = (rg.ImageParam("float32", 3, name) for name in ("queries", "keys", "values"))
        bias = rg.ImageParam("float32", 2, "bias")
        score, largest, weight, total, mixed = (rg.Func(name) for name in ("score", "largest", "weight", "total",
                                                                           "mixed"))
        r, s, before = rg.RDom([(0, depth)]), rg.RDom([(0, window)]), rg.max(t - w, 0)
        product = rg.sum(queries[r, t, h] * keys[r, before, h]) / math.sqrt(depth) + bias[w, h]
        score[w, t, h] = rg.select(t - w >= 0, product, -1e9)
        largest[t, h] = rg.maximum(score[s, t, h])
        weight[w, t, h] = rg.exp(score[w, t, h] - largest[t, h])
        total[t, h] = rg.sum(weight[s, t, h])
        mixed[d, t, h] = rg.sum(weight[s, t, h] * values[d, rg.max(t - s, 0), h]) / total[t, h]
        return mixed, [queries, keys, values, bias], [depth, length, heads]

    def pytorch(queries, keys, values, bias):
        _, length, depth = queries.shape
        window = bias.shape[1]

        def windows(tensor):
            """[heads, length, depth, window], the farthest position first."""
            return F.pad(tensor, (0, 0, window - 1, 0)).unfold(1, window, 1)

        score = torch.einsum("htd,htdw->htw", queries, windows(keys)) / math.sqrt(depth) + bias.flip(1)[:, None]
        outside = torch.arange(length)[:, None] + torch.arange(window) < window - 1
        weight = torch.softmax(score.masked_fill(outside, -1e9), -1)
        return torch.einsum("htw,htdw->htd", weight, windows(values))
