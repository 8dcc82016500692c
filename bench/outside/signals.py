"""signals.py -- signals over time: spectra, filters, change of the sampling rate."""
import math

import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

t, k, s = (rg.Var(name) for name in "tks")


class LogSpectrogram(Program):
    """Logarithm of the power of overlapping windows of a signal under learned filters, as front ends of speech models
    compute it.
    Source: Zeghidour et al., LEAF: a learnable frontend for audio classification, ICLR 2021."""

    HOP = 128

    def inputs(values, small):
        signals, samples, window, filters = (2, 900, 256, 8) if small else (4, 65536, 512, 128)
        scale = 1 / math.sqrt(window)
        return values(signals, samples, low=-1), values(filters, window, low=-scale, high=scale), \
            values(filters, window, low=-scale, high=scale)

    def define(of_signals, of_real, _):
        (count, samples), (filters, window), hop = of_signals, of_real, LogSpectrogram.HOP
        signals = rg.ImageParam("float32", 2, "signals")
        real, imaginary = rg.ImageParam("float32", 2, "real"), rg.ImageParam("float32", 2, "imaginary")
        a, b, power = rg.Func("a"), rg.Func("b"), rg.Func("power")
        r = rg.RDom([(0, window)])
        a[k, t, s] = 0.0
        a[k, t, s] += signals[hop * t + r, s] * real[r, k]
        b[k, t, s] = 0.0
        b[k, t, s] += signals[hop * t + r, s] * imaginary[r, k]
        power[k, t, s] = rg.log(a[k, t, s] * a[k, t, s] + b[k, t, s] * b[k, t, s] + 1e-3)
        return power, [signals, real, imaginary], [filters, (samples - window) // hop + 1, count]

    def pytorch(signals, real, imaginary):
        windows = signals.unfold(-1, real.shape[1], LogSpectrogram.HOP)
        a, b = windows @ real.T, windows @ imaginary.T
        return torch.log(a**2 + b**2 + 1e-3)


class BiquadCascade(Program):
    """Four recursive filters of second order in a row, applied to many signals, with learned coefficients. PyTorch's
    users filter through the frequency response.
    Source: Nercessian, Neural parametric equalizer matching using differentiable biquads, DAFx 2020."""

    SECTIONS = 4

    def inputs(values, small):
        signals, samples = (3, 200) if small else (64, 16384)
        radius, turn = values(4, low=0.5, high=0.8), values(4, low=0.3, high=2.5)
        coefficients = torch.stack([values(4, low=0.5), values(4, low=-0.5, high=0.5), values(4, low=-0.3, high=0.3),
                                    -2 * radius * torch.cos(turn), radius**2], -1)
        return values(signals, samples, low=-1), coefficients

    def define(of_signals, of_coefficients):
        count, samples = of_signals
        signals, coefficients = rg.ImageParam("float32", 2, "signals"), rg.ImageParam("float32", 2, "coefficients")
        filtered = rg.BoundaryConditions.constant_exterior(signals, 0.0, [(0, samples), (0, count)])
        r = rg.RDom([(0, samples)])
        for section in range(of_coefficients[0]):
            b0, b1, b2, a1, a2 = (coefficients[at, section] for at in range(5))
            f = rg.Func(f"section_{section}")
            f[t, s] = rg.select(t < 0, 0.0,
                                b0 * filtered[t, s] + b1 * filtered[t - 1, s] + b2 * filtered[t - 2, s])
            f[r, s] = f[r, s] - a1 * f[r - 1, s] - a2 * f[r - 2, s]
            filtered = f
        result = rg.Func("result")  # whose sizes leave out the two zeros before the start
        result[t, s] = filtered[t, s]
        return result, [signals, coefficients], [samples, count]

    def pytorch(signals, coefficients):
        samples = signals.shape[1]
        ones = torch.ones_like(coefficients[:, :1])
        response = (torch.fft.rfft(coefficients[:, :3], 2 * samples)
                    / torch.fft.rfft(torch.cat([ones, coefficients[:, 3:]], 1), 2 * samples)).prod(0)
        return torch.fft.irfft(torch.fft.rfft(signals, 2 * samples) * response, 2 * samples)[:, :samples]


class PolyphaseResample(Program):
    """Three samples for each two by a filter with learned taps, of which every output uses one in three.
    Source: Vaidyanathan, Multirate digital filters, filter banks, polyphase networks, Proc. IEEE 1990."""

    UP, DOWN = 3, 2

    def inputs(values, small):
        signals, samples, taps = (3, 40, 12) if small else (32, 48000, 48)
        return values(signals, samples, low=-1), values(taps, low=-0.3, high=0.3)

    def define(of_signals, of_taps):
        (count, samples), (length,) = of_signals, of_taps
        up, down = PolyphaseResample.UP, PolyphaseResample.DOWN
        signals, taps = rg.ImageParam("float32", 2, "signals"), rg.ImageParam("float32", 1, "taps")
        padded = rg.BoundaryConditions.constant_exterior(signals, 0.0, [(0, samples), (0, count)])
        r, resampled = rg.RDom([(0, length // up)]), rg.Func("resampled")
        resampled[t, s] = 0.0
        resampled[t, s] += padded[t * down // up - r, s] * taps[t * down % up + up * r]
        return resampled, [signals, taps], [samples * up // down, count]

    def pytorch(signals, taps):
        up, down = PolyphaseResample.UP, PolyphaseResample.DOWN
        filled = F.conv_transpose1d(signals[:, None], taps[None, None], stride=up)[:, 0]
        return filled[:, :signals.shape[1] * up:down]
