"""geometry.py -- cameras, particles, splats, deformations and lenses."""
import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

x, y, i, j, k, c, g = (rg.Var(name) for name in "xyijkcg")


class Reprojection(Program):
    """Residuals of a bundle adjustment: each observation compares the projection of a point by a camera (rotation
    vector, translation, focal length, two distortions) with a measured position.
    Source: Agarwal et al., Bundle adjustment in the large, ECCV 2010."""

    constants = (2,)

    def inputs(values, small):
        cameras, points, observations = (4, 9, 30) if small else (200, 20000, 200000)
        low = torch.tensor([0.1, 0.1, 0.1, -1, -1, -9, 400, -0.1, -0.01], dtype=torch.float64)
        high = torch.tensor([0.4, 0.4, 0.4, 1, 1, -8, 500, 0.1, 0.01], dtype=torch.float64)
        return low + (high - low) * values(cameras, 9), values(points, 3, low=-1), \
            values(observations, 2, low=-50, high=50), \
            (values(observations) * cameras).int(), (values(observations) * points).int()

    def define(of_cameras, of_points, of_observed, *_):
        cameras, points, observed = (rg.ImageParam("float32", 2, name) for name in ("cameras", "points", "observed"))
        camera_of, point_of = rg.ImageParam("int32", 1, "camera_of"), rg.ImageParam("int32", 1, "point_of")
        camera = rg.clamp(camera_of[i], 0, of_cameras[0] - 1)
        point = rg.clamp(point_of[i], 0, of_points[0] - 1)
        r0, r1, r2, t0, t1, t2, focal, k1, k2 = (cameras[at, camera] for at in range(9))
        p0, p1, p2 = (points[at, point] for at in range(3))
        angle = rg.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        a0, a1, a2 = r0 / angle, r1 / angle, r2 / angle
        cosine, sine = rg.cos(angle), rg.sin(angle)
        along = (a0 * p0 + a1 * p1 + a2 * p2) * (1 - cosine)
        q0 = p0 * cosine + (a1 * p2 - a2 * p1) * sine + a0 * along + t0
        q1 = p1 * cosine + (a2 * p0 - a0 * p2) * sine + a1 * along + t1
        q2 = p2 * cosine + (a0 * p1 - a1 * p0) * sine + a2 * along + t2
        u, v = -q0 / q2, -q1 / q2
        squared = u * u + v * v
        scale = focal * (1 + k1 * squared + k2 * squared * squared)
        residual = rg.Func("residual")
        residual[j, i] = rg.select(j == 0, scale * u, scale * v) - observed[j, i]
        return residual, [cameras, points, observed, camera_of, point_of], [2, of_observed[0]]

    def pytorch(cameras, points, observed, camera_of, point_of):
        camera, point = cameras.index_select(0, camera_of), points.index_select(0, point_of)
        angle = camera[:, :3].norm(dim=1, keepdim=True)
        axis, cosine, sine = camera[:, :3] / angle, torch.cos(angle), torch.sin(angle)
        turned = (point * cosine + torch.linalg.cross(axis, point) * sine
                  + axis * (axis * point).sum(1, keepdim=True) * (1 - cosine)) + camera[:, 3:6]
        projected = -turned[:, :2] / turned[:, 2:]
        squared = (projected**2).sum(1, keepdim=True)
        return camera[:, 6:7] * (1 + camera[:, 7:8] * squared + camera[:, 8:9] * squared**2) * projected - observed


class SplatPoints(Program):
    """Particles add their charges to the four nearest points of a grid, with bilinear weights.
    Source: Hockney and Eastwood, Computer Simulation Using Particles, section 5-2 (cloud in cell)."""

    def inputs(values, small):
        particles, size = (40, 10) if small else (1000000, 512)
        return values(particles, 2, low=0, high=size - 1.001), values(particles, low=-1), values(size, size)

    def define(of_positions, _, of_background):
        positions, charges = rg.ImageParam("float32", 2, "positions"), rg.ImageParam("float32", 1, "charges")
        background, density = rg.ImageParam("float32", 2, "background"), rg.Func("density")
        (height, width), r = of_background, rg.RDom([(0, of_positions[0])])
        u, v = positions[0, r], positions[1, r]
        left = rg.clamp(rg.cast("int32", rg.floor(u)), 0, width - 2)
        top = rg.clamp(rg.cast("int32", rg.floor(v)), 0, height - 2)
        a, b = u - rg.floor(u), v - rg.floor(v)
        density[x, y] = background[x, y]
        density[left, top] += charges[r] * (1 - a) * (1 - b)
        density[left + 1, top] += charges[r] * a * (1 - b)
        density[left, top + 1] += charges[r] * (1 - a) * b
        density[left + 1, top + 1] += charges[r] * a * b
        return density, [positions, charges, background], [width, height]

    def pytorch(positions, charges, background):
        width, corner = background.shape[1], positions.detach().floor()
        (a, b), (left, top) = (positions - corner).unbind(1), corner.long().unbind(1)
        at, density = top * width + left, background.flatten()
        density = density.index_add(0, at, charges * (1 - a) * (1 - b)).index_add(0, at + 1, charges * a * (1 - b))
        density = density.index_add(0, at + width, charges * (1 - a) * b).index_add(0, at + width + 1, charges * a * b)
        return density.view_as(background)


class GaussianSplatting(Program):
    """Translucent Gaussians in the plane, sorted from front to back, over a background.
    Source: Kerbl et al., 3D Gaussian splatting for real-time radiance field rendering, SIGGRAPH 2023, equation 3."""

    def inputs(values, small):
        count, size = (5, 16) if small else (48, 256)
        spread = values(count, 3, low=4, high=60) / size**2
        return values(count, 2, high=size), spread * torch.tensor([1, 0.2, 1], dtype=torch.float64), \
            values(count, 3), values(count, low=0.2, high=0.9), values(3, size, size)

    def define(of_centres, _, __, ___, of_background):
        count, (_, height, width) = of_centres[0], of_background
        centres, spreads, colours = (rg.ImageParam("float32", 2, name) for name in ("centres", "spreads", "colours"))
        opacities, background = rg.ImageParam("float32", 1, "opacities"), rg.ImageParam("float32", 3, "background")
        alpha, passed, image = rg.Func("alpha"), rg.Func("passed"), rg.Func("image")
        across, down = rg.f32(x) + 0.5 - centres[0, g], rg.f32(y) + 0.5 - centres[1, g]
        distance = (spreads[0, g] * across * across + 2 * spreads[1, g] * across * down
                    + spreads[2, g] * down * down)
        alpha[x, y, g] = opacities[g] * rg.exp(-0.5 * distance)
        r = rg.RDom([(0, count)])
        passed[x, y, g] = 1.0
        passed[x, y, r + 1] = passed[x, y, r] * (1 - alpha[x, y, r])
        image[x, y, c] = passed[x, y, count] * background[x, y, c]
        image[x, y, c] += passed[x, y, r] * alpha[x, y, r] * colours[c, r]
        return image, [centres, spreads, colours, opacities, background], [width, height, 3]

    def pytorch(centres, spreads, colours, opacities, background):
        _, height, width = background.shape
        across = torch.arange(width, dtype=centres.dtype) + 0.5 - centres[:, :1, None]
        down = torch.arange(height, dtype=centres.dtype)[:, None] + 0.5 - centres[:, 1:, None]
        a, b, d = spreads[:, :, None, None].unbind(1)
        alpha = opacities[:, None, None] * torch.exp(-0.5 * (a * across**2 + 2 * b * across * down + d * down**2))
        passed = torch.cumprod(torch.cat([torch.ones_like(alpha[:1]), 1 - alpha]), 0)
        return torch.einsum("gyx,gc->cyx", passed[:-1] * alpha, colours) + passed[-1] * background


def cubic_weights(w):
    """The four weights of a uniform cubic B-spline at distance w behind a knot."""
    return ((1 - w) * (1 - w) * (1 - w) / 6, (3 * w * w * w - 6 * w * w + 4) / 6,
            (-3 * w * w * w + 3 * w * w + 3 * w + 1) / 6, w * w * w / 6)


class SplineDeformation(Program):
    """Moves an image by a smooth field of displacements, a cubic B-spline over a coarse grid of control points, as in
    the registration of medical images.
    Source: Rueckert et al., Nonrigid registration using free-form deformations, IEEE TMI 1999."""

    CELL = 32  # pixels between control points
    # Coordinates of up to 768 in float32 have fractions of 2^-14, and a floor that they may fall on either side of.
    tolerance = 5e-3

    def inputs(values, small):
        n = 64 if small else 768
        at = torch.arange(n, dtype=torch.float64) / 20
        image = torch.sin(at)[:, None] * torch.cos(0.7 * at) + 0.2 * torch.sin(0.5 * (at[:, None] + at))
        knots = n // SplineDeformation.CELL + 3
        return image, values(2, knots, knots, low=-9, high=9)

    def define(of_image, _):
        height, width = of_image
        image, control = rg.ImageParam("float32", 2, "image"), rg.ImageParam("float32", 3, "control")
        weights, moved, warped = rg.Func("weights"), rg.Func("moved"), rg.Func("warped")
        cell, r = SplineDeformation.CELL, rg.RDom([(0, 4), (0, 4)])
        weights[x, k] = rg.mux(k, list(cubic_weights(rg.f32(x % cell) / cell)))
        moved[x, y, c] = 0.0
        moved[x, y, c] += weights[x, r.x] * weights[y, r.y] * control[x // cell + r.x, y // cell + r.y, c]
        u = rg.clamp(rg.f32(x) + moved[x, y, 0], 0.0, width - 1.0)
        v = rg.clamp(rg.f32(y) + moved[x, y, 1], 0.0, height - 1.0)
        left = rg.clamp(rg.cast("int32", rg.floor(u)), 0, width - 2)
        top = rg.clamp(rg.cast("int32", rg.floor(v)), 0, height - 2)
        a, b = u - rg.f32(left), v - rg.f32(top)
        warped[x, y] = rg.lerp(rg.lerp(image[left, top], image[left + 1, top], a),
                               rg.lerp(image[left, top + 1], image[left + 1, top + 1], a), b)
        return warped, [image, control], [width, height]

    def pytorch(image, control):
        def moved(size, knots):
            """Maps the control points along an axis to displacements of pixels: [size, knots]."""
            at, cell = torch.arange(size), SplineDeformation.CELL
            weights = torch.stack(cubic_weights((at % cell).to(image.dtype) / cell), 1)
            return torch.zeros(size, knots, dtype=image.dtype).scatter(
                1, (at // cell)[:, None] + torch.arange(4), weights)

        height, width = image.shape
        _, rows, columns = control.shape
        u, v = moved(height, rows) @ control @ moved(width, columns).T
        u = (torch.arange(width) + u) * (2 / (width - 1)) - 1
        v = (torch.arange(height)[:, None] + v) * (2 / (height - 1)) - 1
        places = torch.stack([u, v], -1)[None]
        return F.grid_sample(image[None, None], places, padding_mode="border", align_corners=True)[0, 0]


class LensRays(Program):
    """Rays through six spherical surfaces between glasses, by Snell's law, up to the plane of the sensor; gradients for
    the design of the lens.
    Source: Spencer and Murty, General ray-tracing procedure, JOSA 1962."""

    def inputs(values, small):
        rays = 50 if small else 400000
        return values(2, rays, low=-4, high=4), values(2, rays, low=-0.05, high=0.05), \
            values(6, low=-0.03, high=0.03), values(6, low=3, high=6), \
            torch.tensor([1, 1.6, 1, 1.7, 1, 1.5, 1], dtype=torch.float64)

    def define(of_origins, *_):
        origins, slopes = rg.ImageParam("float32", 2, "origins"), rg.ImageParam("float32", 2, "slopes")
        curvatures, gaps, indices = (rg.ImageParam("float32", 1, name) for name in ("curvatures", "gaps", "indices"))
        ray = rg.Func("ray_0")
        u, v = slopes[i, 0], slopes[i, 1]
        ray[i] = (origins[i, 0], origins[i, 1], u, v, rg.sqrt(1 - u * u - v * v))
        for surface in range(6):
            px, py, dx, dy, dz = (ray[i][at] for at in range(5))
            gap, bend = gaps[surface], curvatures[surface]
            pz = -gap  # relative to the vertex of the surface
            b = dz - bend * (px * dx + py * dy + pz * dz)
            e = bend * (px * px + py * py + pz * pz) - 2 * pz
            way = e / (b + rg.sqrt(b * b - bend * e))
            qx, qy, qz = px + way * dx, py + way * dy, pz + way * dz
            nx, ny, nz = -bend * qx, -bend * qy, 1 - bend * qz
            ratio = indices[surface] / indices[surface + 1]
            cosine = dx * nx + dy * ny + dz * nz
            turn = rg.sqrt(1 - ratio * ratio * (1 - cosine * cosine)) - ratio * cosine
            here = rg.Func(f"ray_{surface + 1}")
            dx, dy, dz = ratio * dx + turn * nx, ratio * dy + turn * ny, ratio * dz + turn * nz
            # Back to the plane through the vertex.
            here[i] = (qx - qz * dx / dz, qy - qz * dy / dz, dx, dy, dz)
            ray = here
        spot = rg.Func("spot")
        spot[i, c] = rg.select(c == 0, ray[i][0] + 20 * ray[i][2] / ray[i][4], ray[i][1] + 20 * ray[i][3] / ray[i][4])
        return spot, [origins, slopes, curvatures, gaps, indices], [of_origins[1], 2]

    def pytorch(origins, slopes, curvatures, gaps, indices):
        px, py = origins
        dx, dy = slopes
        dz = torch.sqrt(1 - dx**2 - dy**2)
        for surface in range(6):
            gap, bend = gaps[surface], curvatures[surface]
            b = dz - bend * (px * dx + py * dy - gap * dz)
            e = bend * (px**2 + py**2 + gap**2) + 2 * gap
            way = e / (b + torch.sqrt(b**2 - bend * e))
            qx, qy, qz = px + way * dx, py + way * dy, way * dz - gap
            nx, ny, nz = -bend * qx, -bend * qy, 1 - bend * qz
            ratio = indices[surface] / indices[surface + 1]
            cosine = dx * nx + dy * ny + dz * nz
            turn = torch.sqrt(1 - ratio**2 * (1 - cosine**2)) - ratio * cosine
            dx, dy, dz = ratio * dx + turn * nx, ratio * dy + turn * ny, ratio * dz + turn * nz
            px, py = qx - qz * dx / dz, qy - qz * dy / dz
        return torch.stack([px + 20 * dx / dz, py + 20 * dy / dz])
