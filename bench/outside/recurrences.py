"""recurrences.py -- each value depends on the previous ones: elimination, volatility, alignment of series."""
import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

x, y, i, j, n, s, t = (rg.Var(name) for name in "xyijnst")


class TridiagonalRows(Program):
    """Solves one tridiagonal system per row, as an implicit step of diffusion along rows does, by elimination and back
    substitution.
    Source: Press et al., Numerical Recipes, section 2.4."""

    def inputs(values, small):
        shape = (6, 11) if small else (1024, 256)
        return values(*shape, low=-1, high=0), values(*shape, low=2.2, high=3), values(*shape, low=-1, high=0), \
            values(*shape, low=-1)

    def define(of_lower, *_):
        height, width = of_lower
        lower, diagonal, upper, right = (rg.ImageParam("float32", 2, name)
                                         for name in ("lower", "diagonal", "upper", "right"))
        ratio, reduced, solution = rg.Func("ratio"), rg.Func("reduced"), rg.Func("solution")
        r = rg.RDom([(1, width - 1)])
        ratio[x, y] = upper[x, y] / diagonal[x, y]
        ratio[r, y] = upper[r, y] / (diagonal[r, y] - lower[r, y] * ratio[r - 1, y])
        reduced[x, y] = right[x, y] / diagonal[x, y]
        reduced[r, y] = ((right[r, y] - lower[r, y] * reduced[r - 1, y])
                         / (diagonal[r, y] - lower[r, y] * ratio[r - 1, y]))
        solution[x, y] = reduced[x, y]
        back = width - 1 - r
        solution[back, y] = reduced[back, y] - ratio[back, y] * solution[back + 1, y]
        return solution, [lower, diagonal, upper, right], [width, height]

    def pytorch(lower, diagonal, upper, right):
        lower, diagonal, upper, right = (t.T.contiguous().unbind() for t in (lower, diagonal, upper, right))
        ratios, reduced = [upper[0] / diagonal[0]], [right[0] / diagonal[0]]
        for a, b, c, d in zip(lower[1:], diagonal[1:], upper[1:], right[1:]):
            pivot = b - a * ratios[-1]
            ratios.append(c / pivot)
            reduced.append((d - a * reduced[-1]) / pivot)
        solution = [reduced[-1]]
        for ratio, value in zip(ratios[-2::-1], reduced[-2::-1]):
            solution.append(value - ratio * solution[-1])
        return torch.stack(solution[::-1], -1)


class GarchLikelihood(Program):
    """Negative log-likelihood of returns whose variance is a recurrence, for many assets at a time.
    Source: Bollerslev, Generalized autoregressive conditional heteroskedasticity, J. of Econometrics 1986."""

    constants = (0,)

    def inputs(values, small):
        assets, days = (5, 9) if small else (2048, 500)
        return values(assets, days, low=-1), values(assets, low=0.05, high=0.1), \
            values(assets, low=0.05, high=0.15), values(assets, low=0.7, high=0.8)

    def define(of_returns, *_):
        assets, days = of_returns
        returns = rg.ImageParam("float32", 2, "returns")
        base, news, memory = (rg.ImageParam("float32", 1, name) for name in ("base", "news", "memory"))
        variance, loss = rg.Func("variance"), rg.Func("loss")
        variance[t, s] = base[s] / (1 - news[s] - memory[s])
        r, day = rg.RDom([(1, days - 1)]), rg.RDom([(0, days)])
        variance[r, s] = base[s] + news[s] * returns[r - 1, s] * returns[r - 1, s] + memory[s] * variance[r - 1, s]
        loss[s] = 0.0
        loss[s] += 0.5 * (rg.log(variance[day, s]) + returns[day, s] * returns[day, s] / variance[day, s])
        return loss, [returns, base, news, memory], [assets]

    def pytorch(returns, base, news, memory):
        squares = (returns**2).T
        drive = base + news * squares[:-1]
        variances = [base / (1 - news - memory)]
        for pushed in drive:
            variances.append(pushed + memory * variances[-1])
        variance = torch.stack(variances)
        return 0.5 * (torch.log(variance) + squares / variance).sum(0)


class SoftDtw(Program):
    """The soft minimum over all alignments of two series, for many pairs: dynamic programming over a square.
    Source: Cuturi and Blondel, Soft-DTW: a differentiable loss function for time-series, ICML 2017, algorithm 1."""

    FAR = 1e10  # outside the square
    SOFTNESS = 0.5

    def inputs(values, small):
        pairs, length = (3, 7) if small else (64, 128)
        return values(pairs, length, low=-1), values(pairs, length, low=-1)

    def define(of_first, _):
        pairs, length = of_first
        first, second = rg.ImageParam("float32", 2, "first"), rg.ImageParam("float32", 2, "second")
        total, distance = rg.Func("total"), rg.Func("distance")
        total[i, j, n] = rg.select((i == 0) & (j == 0), 0.0, SoftDtw.FAR)
        r = rg.RDom([(1, length), (1, length)])
        a, b, c = total[r.x - 1, r.y - 1, n], total[r.x - 1, r.y, n], total[r.x, r.y - 1, n]
        least, g = rg.min(a, rg.min(b, c)), SoftDtw.SOFTNESS
        soft = least - g * rg.log(rg.exp((least - a) / g) + rg.exp((least - b) / g) + rg.exp((least - c) / g))
        apart = first[r.x - 1, n] - second[r.y - 1, n]
        total[r.x, r.y, n] = apart * apart + soft
        distance[n] = total[length, length, n]
        return distance, [first, second], [pairs]

    def pytorch(first, second):
        pairs, length = first.shape
        cost = (first[:, :, None] - second[:, None, :]) ** 2
        # Diagonal d of the costs in column d: diagonals[:, i, d] == cost[:, i, d - i].
        diagonals = F.pad(cost, (0, length), value=SoftDtw.FAR).flatten(1)[:, :-length]
        diagonals = diagonals.view(pairs, length, 2 * length - 1).permute(2, 0, 1).contiguous()
        before = F.pad(cost.new_full((pairs, length), SoftDtw.FAR), (1, 0))
        here = cost.new_full((pairs, length + 1), SoftDtw.FAR)
        for costs in diagonals:
            around = torch.stack([before[:, :-1], here[:, :-1], here[:, 1:]])
            soft = -SoftDtw.SOFTNESS * torch.logsumexp(-around / SoftDtw.SOFTNESS, 0)
            before, here = here, F.pad(costs + soft, (1, 0), value=SoftDtw.FAR)
        return here[:, -1]
