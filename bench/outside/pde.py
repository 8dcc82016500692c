"""pde.py -- partial differential equations: steps through time, relaxation, diffusion."""
import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

x, y, t = (rg.Var(name) for name in "xyt")


class HeatSteps(Program):
    """Explicit steps of heat through a plate of varying conductivity, whose border keeps its temperature."""

    STEPS = 50

    def inputs(values, small):
        n = 24 if small else 512
        return values(n, n), values(n, n, low=0.05, high=0.24)

    def define(of_start, of_conductivity):
        height, width = of_start
        start, conductivity = rg.ImageParam("float32", 2, "start"), rg.ImageParam("float32", 2, "conductivity")
        heat, last = rg.Func("heat"), rg.Func("last")
        heat[x, y, t] = start[x, y]
        r = rg.RDom([(1, width - 2), (1, height - 2), (0, HeatSteps.STEPS)])
        around = (heat[r.x - 1, r.y, r.z] + heat[r.x + 1, r.y, r.z] + heat[r.x, r.y - 1, r.z]
                  + heat[r.x, r.y + 1, r.z])
        heat[r.x, r.y, r.z + 1] = heat[r.x, r.y, r.z] + conductivity[r.x, r.y] * (around - 4 * heat[r.x, r.y, r.z])
        last[x, y] = heat[x, y, HeatSteps.STEPS]
        return last, [start, conductivity], [width, height]

    def pytorch(start, conductivity):
        heat, inner = start, conductivity[1:-1, 1:-1]
        for _ in range(HeatSteps.STEPS):
            around = heat[1:-1, :-2] + heat[1:-1, 2:] + heat[:-2, 1:-1] + heat[2:, 1:-1]
            heat = heat + F.pad(inner * (around - 4 * heat[1:-1, 1:-1]), (1, 1, 1, 1))
        return heat


class WaveReceivers(Program):
    """An acoustic wave from one source, recorded by a line of receivers. Inputs are the squared speed of the medium at
    each point and the source over time.
    Source: Tarantola, Inversion of seismic reflection data in the acoustic approximation, Geophysics 1984."""

    DEPTH = 3  # of the source and of the receivers

    def inputs(values, small):
        n, steps = (20, 12) if small else (256, 100)
        return values(n, n, low=0.1, high=0.25), values(steps, low=-1)

    def define(of_speed, of_source):
        (height, width), (steps,) = of_speed, of_source
        speed, source = rg.ImageParam("float32", 2, "speed"), rg.ImageParam("float32", 1, "source")
        wave, traces, depth = rg.Func("wave"), rg.Func("traces"), WaveReceivers.DEPTH
        wave[x, y, t] = 0.0
        r = rg.RDom([(1, width - 2), (1, height - 2), (1, steps)])
        here = wave[r.x, r.y, r.z]
        around = (wave[r.x - 1, r.y, r.z] + wave[r.x + 1, r.y, r.z] + wave[r.x, r.y - 1, r.z]
                  + wave[r.x, r.y + 1, r.z])
        pulse = rg.select((r.x == width // 2) & (r.y == depth), source[r.z - 1], 0.0)
        wave[r.x, r.y, r.z + 1] = 2 * here - wave[r.x, r.y, r.z - 1] + speed[r.x, r.y] * (around - 4 * here) + pulse
        traces[x, t] = wave[x, depth, t + 2]
        return traces, [speed, source], [width, steps]

    def pytorch(speed, source):
        place = torch.zeros_like(speed)
        place[WaveReceivers.DEPTH, speed.shape[1] // 2] = 1
        before = here = torch.zeros_like(speed)
        traces = []
        for pulse in source:
            around = here[1:-1, :-2] + here[1:-1, 2:] + here[:-2, 1:-1] + here[2:, 1:-1]
            change = F.pad(speed[1:-1, 1:-1] * (around - 4 * here[1:-1, 1:-1]), (1, 1, 1, 1))
            before, here = here, 2 * here - before + change + pulse * place
            traces.append(here[WaveReceivers.DEPTH])
        return torch.stack(traces)


class RedBlackPressure(Program):
    """Relaxation of a Poisson equation for pressure, in place, first the red and then the black points of each sweep.
    Source: Press et al., Numerical Recipes, section 20.5."""

    SWEEPS = 16

    def inputs(values, small):
        n = 18 if small else 512
        return values(n, n, low=-1), torch.tensor(1.5, dtype=torch.float64)

    def define(of_divergence, _):
        height, width = of_divergence
        divergence, relaxation = rg.ImageParam("float32", 2, "divergence"), rg.Param("float32", "relaxation")
        pressure = rg.Func("pressure")
        pressure[x, y] = 0.0
        r = rg.RDom([(1, width - 2), (1, height - 2), (0, 2), (0, RedBlackPressure.SWEEPS)])
        r.where((r.x + r.y) % 2 == r.z)
        around = pressure[r.x - 1, r.y] + pressure[r.x + 1, r.y] + pressure[r.x, r.y - 1] + pressure[r.x, r.y + 1]
        wanted = (around - divergence[r.x, r.y]) / 4
        pressure[r.x, r.y] = pressure[r.x, r.y] + relaxation * (wanted - pressure[r.x, r.y])
        return pressure, [divergence, relaxation], [width, height]

    def pytorch(divergence, relaxation):
        height, width = divergence.shape
        parity = (torch.arange(height)[:, None] + torch.arange(width)) % 2
        inside = F.pad(torch.ones(height - 2, width - 2, dtype=torch.bool), (1, 1, 1, 1))
        colours = [inside & (parity == colour) for colour in (0, 1)]
        pressure = torch.zeros_like(divergence)
        for _ in range(RedBlackPressure.SWEEPS):
            for colour in colours:
                around = pressure[1:-1, :-2] + pressure[1:-1, 2:] + pressure[:-2, 1:-1] + pressure[2:, 1:-1]
                wanted = F.pad(around - divergence[1:-1, 1:-1], (1, 1, 1, 1)) / 4
                pressure = torch.where(colour, pressure + relaxation * (wanted - pressure), pressure)
        return pressure


class EdgeDiffusion(Program):
    """Forty steps of diffusion that stops at edges, one Func per step. Returns the smooth image, the detail that was
    removed, and the conductance that is left.
    Source: Perona and Malik, Scale-space and edge detection using anisotropic diffusion, PAMI 1990."""

    STEPS = 40

    def inputs(values, small):
        n = 20 if small else 256
        return values(n, n), torch.tensor(0.3, dtype=torch.float64)

    def define(of_image, _):
        height, width = of_image
        image, contrast = rg.ImageParam("float32", 2, "image"), rg.Param("float32", "contrast")

        def conductance(difference):
            return 1 / (1 + (difference / contrast) * (difference / contrast))

        def padded(f):
            return rg.BoundaryConditions.repeat_edge(f, [(0, width), (0, height)])

        smooth = rg.Func("smooth_0")
        smooth[x, y] = image[x, y]
        for step in range(EdgeDiffusion.STEPS):
            f, following = padded(smooth), rg.Func(f"smooth_{step + 1}")
            flow = 0.0
            for across, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                difference = f[x + across, y + down] - f[x, y]
                flow = flow + conductance(difference) * difference
            following[x, y] = f[x, y] + 0.2 * flow
            smooth = following
        f, detail, edges = padded(smooth), rg.Func("detail"), rg.Func("edges")
        detail[x, y] = image[x, y] - smooth[x, y]
        edges[x, y] = conductance(f[x + 1, y] - f[x, y]) * conductance(f[x, y + 1] - f[x, y])
        return [smooth, detail, edges], [image, contrast], [width, height]

    def pytorch(image, contrast):
        def conductance(difference):
            return 1 / (1 + (difference / contrast) ** 2)

        def padded(smooth):
            return F.pad(smooth[None, None], (1, 1, 1, 1), mode="replicate")[0, 0]

        smooth = image
        for _ in range(EdgeDiffusion.STEPS):
            f, flow = padded(smooth), 0
            for moved in (f[1:-1, 2:], f[1:-1, :-2], f[2:, 1:-1], f[:-2, 1:-1]):
                flow = flow + conductance(moved - smooth) * (moved - smooth)
            smooth = smooth + 0.2 * flow
        f = padded(smooth)
        edges = conductance(f[1:-1, 2:] - smooth) * conductance(f[2:, 1:-1] - smooth)
        return smooth, image - smooth, edges
