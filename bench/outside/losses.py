"""losses.py -- losses of training and statistics: sums over rows and over whole images, optimal transport."""
import math

import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

i, j, a, b, d = (rg.Var(name) for name in "ijabd")


class CrossEntropy(Program):
    """Mean cross entropy of rows of logits with labels."""

    def inputs(values, small):
        rows, classes = (6, 10) if small else (8192, 1000)
        return values(rows, classes, low=-4, high=4), (values(rows) * classes).long()

    def define(of_logits, _):
        rows, classes = of_logits
        logits, labels = rg.ImageParam("float32", 2, "logits"), rg.ImageParam("int64", 1, "labels")
        largest, total, loss = rg.Func("largest"), rg.Func("total"), rg.Func("loss")
        r, row = rg.RDom([(0, classes)]), rg.RDom([(0, rows)])
        largest[i] = rg.maximum(logits[r, i])
        total[i] = 0.0
        total[i] += rg.exp(logits[r, i] - largest[i])
        label = rg.clamp(rg.cast("int32", labels[row]), 0, classes - 1)
        loss[()] = 0.0
        loss[()] += (rg.log(total[row]) + largest[row] - logits[label, row]) / rows
        return loss, [logits, labels], []

    def pytorch(logits, labels):
        return F.cross_entropy(logits, labels)


class Sinkhorn(Program):
    """Cost of the entropic optimal transport between two clouds of points, by ten iterations in the logarithmic domain.
    Source: Peyré and Cuturi, Computational Optimal Transport, section 4.4."""

    SOFTNESS, ITERATIONS = 0.05, 10

    def inputs(values, small):
        first, second = (7, 9) if small else (640, 640)
        return values(first, 2), values(second, 2, low=0.2, high=1.2)

    def define(of_first, of_second):
        (rows, _), (columns, _), eps = of_first, of_second, Sinkhorn.SOFTNESS
        first, second = rg.ImageParam("float32", 2, "first"), rg.ImageParam("float32", 2, "second")
        cost, plan, loss = rg.Func("cost"), rg.Func("plan"), rg.Func("loss")
        across, down = first[0, i] - second[0, j], first[1, i] - second[1, j]
        cost[j, i] = across * across + down * down
        r, s = rg.RDom([(0, columns)]), rg.RDom([(0, rows)])
        f, g = rg.Func("f_0"), rg.Func("g_0")
        f[i], g[j] = 0.0, 0.0
        for step in range(Sinkhorn.ITERATIONS):
            largest, total, following = rg.Func(f"f_max_{step}"), rg.Func(f"f_sum_{step}"), rg.Func(f"f_{step + 1}")
            largest[i] = rg.maximum((g[r] - cost[r, i]) / eps)
            total[i] = rg.sum(rg.exp((g[r] - cost[r, i]) / eps - largest[i]) / columns)
            following[i] = -eps * (largest[i] + rg.log(total[i]))
            f = following
            largest, total, following = rg.Func(f"g_max_{step}"), rg.Func(f"g_sum_{step}"), rg.Func(f"g_{step + 1}")
            largest[j] = rg.maximum((f[s] - cost[j, s]) / eps)
            total[j] = rg.sum(rg.exp((f[s] - cost[j, s]) / eps - largest[j]) / rows)
            following[j] = -eps * (largest[j] + rg.log(total[j]))
            g = following
        plan[j, i] = rg.exp((f[i] + g[j] - cost[j, i]) / eps) / (rows * columns)
        loss[()] = 0.0
        both = rg.RDom([(0, columns), (0, rows)])
        loss[()] += plan[both.x, both.y] * cost[both.x, both.y]
        return loss, [first, second], []

    def pytorch(first, second):
        eps, rows, columns = Sinkhorn.SOFTNESS, len(first), len(second)
        cost = ((first[:, None] - second[None]) ** 2).sum(-1)
        f, g = cost.new_zeros(rows), cost.new_zeros(columns)
        scaled = cost / eps
        for _ in range(Sinkhorn.ITERATIONS):
            f = -eps * (torch.logsumexp(g / eps - scaled, 1) - math.log(columns))
            g = -eps * (torch.logsumexp(f[:, None] / eps - scaled, 0) - math.log(rows))
        plan = torch.exp((f[:, None] + g) / eps - scaled) / (rows * columns)
        return (plan * cost).sum()


class MutualInformation(Program):
    """Mutual information of two images from their smooth joint histogram, by which images are aligned.
    The first image stays as it is.
    Source: Viola and Wells, Alignment by maximization of mutual information, IJCV 1997."""

    BINS = 32
    constants = (0,)

    def inputs(values, small):
        shape = (9, 12) if small else (256, 512)
        fixed = values(*shape)
        return fixed, (0.7 * fixed + 0.3 * values(*shape)) ** 2

    def define(of_fixed, _):
        (height, width), bins = of_fixed, MutualInformation.BINS
        fixed, moving = rg.ImageParam("float32", 2, "fixed"), rg.ImageParam("float32", 2, "moving")
        r, bin_of, bin_of_both = rg.RDom([(0, width), (0, height)]), rg.RDom([(0, bins)]), rg.RDom([(0, bins)] * 2)

        def kernel(image, knot):
            apart = image[r.x, r.y] * (bins - 1) - rg.f32(knot)
            return rg.exp(-0.5 * apart * apart)

        counts, joint, first, second = rg.Func("counts"), rg.Func("joint"), rg.Func("first"), rg.Func("second")
        counts[a, b] = 0.0
        counts[a, b] += kernel(fixed, a) * kernel(moving, b)
        joint[a, b] = counts[a, b] / rg.sum(counts[bin_of_both.x, bin_of_both.y]) + 1e-9
        first[a] = rg.sum(joint[a, bin_of])
        second[b] = rg.sum(joint[bin_of, b])
        information, s = rg.Func("information"), bin_of_both
        information[()] = 0.0
        information[()] += joint[s.x, s.y] * rg.log(joint[s.x, s.y] / (first[s.x] * second[s.y]))
        return information, [fixed, moving], []

    def pytorch(fixed, moving):
        knots = torch.arange(MutualInformation.BINS, dtype=fixed.dtype)

        def kernels(image):
            return torch.exp(-0.5 * (image.flatten()[:, None] * (len(knots) - 1) - knots) ** 2)

        counts = kernels(fixed).T @ kernels(moving)
        joint = counts / counts.sum() + 1e-9
        return (joint * torch.log(joint / (joint.sum(1, keepdim=True) * joint.sum(0)))).sum()
