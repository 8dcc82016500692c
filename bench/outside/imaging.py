"""imaging.py -- images: colours, orientation, morphology."""
import retrograde as rg
import torch
import torch.nn.functional as F
from program import Program

x, y, c = (rg.Var(name) for name in "xyc")

WHITE = (0.9505, 1.0, 1.089)  # of D65


class LabColours(Program):
    """sRGB to CIE L*a*b*, with the matrix from linear colours as an input, as in the calibration of a camera.
    Source: IEC 61966-2-1 and CIE 15."""

    def inputs(values, small):
        n = 12 if small else 1024
        matrix = torch.tensor([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]],
                              dtype=torch.float64)
        return values(3, n, n), matrix

    def define(of_image, _):
        _, height, width = of_image
        image, matrix = rg.ImageParam("float32", 3, "image"), rg.ImageParam("float32", 2, "matrix")
        linear, response, lab = rg.Func("linear"), rg.Func("response"), rg.Func("lab")
        value = image[x, y, c]
        linear[x, y, c] = rg.select(value <= 0.04045, value / 12.92, rg.pow((value + 0.055) / 1.055, 2.4))
        mixed = (matrix[0, c] * linear[x, y, 0] + matrix[1, c] * linear[x, y, 1] + matrix[2, c] * linear[x, y, 2])
        part = mixed / rg.mux(c, list(WHITE))
        response[x, y, c] = rg.select(part > 0.008856, rg.pow(part, 1 / 3), 7.787 * part + 16 / 116)
        lab[x, y, c] = rg.mux(c, [116 * response[x, y, 1] - 16, 500 * (response[x, y, 0] - response[x, y, 1]),
                                  200 * (response[x, y, 1] - response[x, y, 2])])
        return lab, [image, matrix], [width, height, 3]

    def pytorch(image, matrix):
        linear = torch.where(image <= 0.04045, image / 12.92, ((image + 0.055) / 1.055) ** 2.4)
        white = torch.tensor(WHITE, dtype=image.dtype)[:, None, None]
        part = torch.einsum("dc,chw->dhw", matrix, linear) / white
        response = torch.where(part > 0.008856, part ** (1 / 3), 7.787 * part + 16 / 116)
        return torch.stack([116 * response[1] - 16, 500 * (response[0] - response[1]),
                            200 * (response[1] - response[2])])


class StructureTensor(Program):
    """Energy of edges, and their direction as cosine and sine of the doubled angle, from gradients averaged by learned
    taps: three results of one computation.
    Source: Bigun and Granlund, Optimal orientation detection of linear symmetry, ICCV 1987."""

    def inputs(values, small):
        n = 14 if small else 1024
        return values(n, n), values(7, low=0.05, high=0.2)

    def define(of_image, of_taps):
        (height, width), (count,) = of_image, of_taps
        image, taps = rg.ImageParam("float32", 2, "image"), rg.ImageParam("float32", 1, "taps")
        f = rg.BoundaryConditions.repeat_edge(image, [(0, width), (0, height)])
        across, down, r = rg.Func("across"), rg.Func("down"), rg.RDom([(0, count)])
        across[x, y] = (f[x + 1, y] - f[x - 1, y]) / 2
        down[x, y] = (f[x, y + 1] - f[x, y - 1]) / 2

        def averaged(name, product):
            single, rows, both = rg.Func(name), rg.Func(name + "_rows"), rg.Func(name + "_averaged")
            single[x, y] = product
            inside = rg.BoundaryConditions.repeat_edge(single, [(0, width), (0, height)])
            rows[x, y] = 0.0
            rows[x, y] += taps[r] * inside[x + r - count // 2, y]
            both[x, y] = 0.0
            both[x, y] += taps[r] * rows[x, y + r - count // 2]
            return both

        xx = averaged("xx", across[x, y] * across[x, y])
        xy = averaged("xy", across[x, y] * down[x, y])
        yy = averaged("yy", down[x, y] * down[x, y])
        energy, cosine, sine = rg.Func("energy"), rg.Func("cosine"), rg.Func("sine")
        energy[x, y] = xx[x, y] + yy[x, y]
        apart, mixed = xx[x, y] - yy[x, y], 2 * xy[x, y]
        norm = rg.sqrt(apart * apart + mixed * mixed + 1e-4)
        cosine[x, y], sine[x, y] = apart / norm, mixed / norm
        return [energy, cosine, sine], [image, taps], [width, height]

    def pytorch(image, taps):
        f = F.pad(image[None, None], (1, 1, 1, 1), mode="replicate")[0, 0]
        across, down = (f[1:-1, 2:] - f[1:-1, :-2]) / 2, (f[2:, 1:-1] - f[:-2, 1:-1]) / 2
        products, margin = torch.stack([across * across, across * down, down * down])[:, None], len(taps) // 2
        rows = F.conv2d(F.pad(products, (margin, margin, margin, margin), mode="replicate"), taps[None, None, None])
        xx, xy, yy = F.conv2d(rows, taps[None, None, :, None])[:, 0]
        norm = torch.sqrt((xx - yy) ** 2 + (2 * xy) ** 2 + 1e-4)
        return xx + yy, (xx - yy) / norm, 2 * xy / norm


class SoftErosion(Program):
    """Grey-scale erosion by a learned structuring element with a soft minimum, whose sharpness is learned, too.
    Source: Kirszenberg et al., Going beyond p-convolutions to learn grayscale morphological operators, DGMM 2021."""

    def inputs(values, small):
        n, window = (12, 3) if small else (512, 7)
        return values(n, n), values(window, window, low=0, high=0.3), torch.tensor(12.0, dtype=torch.float64)

    def define(of_image, of_element, _):
        (height, width), (window, _) = of_image, of_element
        image, element = rg.ImageParam("float32", 2, "image"), rg.ImageParam("float32", 2, "element")
        sharpness, total, eroded = rg.Param("float32", "sharpness"), rg.Func("total"), rg.Func("eroded")
        padded = rg.BoundaryConditions.repeat_edge(image, [(0, width), (0, height)])
        r, half = rg.RDom([(0, window), (0, window)]), window // 2
        total[x, y] = 0.0
        total[x, y] += rg.exp(-sharpness * (padded[x + r.x - half, y + r.y - half] + element[r.x, r.y]))
        eroded[x, y] = -rg.log(total[x, y]) / sharpness
        return eroded, [image, element, sharpness], [width, height]

    def pytorch(image, element, sharpness):
        height, width = image.shape
        half = len(element) // 2
        padded = F.pad(image[None, None], (half, half, half, half), mode="replicate")
        windows = F.unfold(padded, element.shape).view(-1, height, width)
        return -torch.logsumexp(-sharpness * (windows + element.flatten()[:, None, None]), 0) / sharpness
