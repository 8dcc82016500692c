#!/usr/bin/python3
"""train.py -- trains a small network that retouches photographs, with two versions of its slicing layer: an operator
made from a pipeline, and plain PyTorch. Both versions get the same data and initial weights.

    train.py [--images FOLDER] [--output FOLDER] [--steps N] [--size PIXELS] [--batch N] [--threads N] [--seed N]

Writes report.json and learned_retouching.png: the two curves of the loss, and the time of a step of both."""
import argparse
import json
import statistics
import time
from pathlib import Path

import numpy
import torch
import torch.nn.functional as F

from slicing import slice_by_pipeline, slice_by_pytorch

LOW = 64  # pixels along each side of the network's input
LEVELS, CELLS = 8, 16


class Retoucher(torch.nn.Module):
    """Computes a grid of affine maps from a picture's small copy, and a guide from its pixels; then slices the grid."""

    def __init__(self, slicing):
        super().__init__()
        self.slicing = slicing
        self.features = torch.nn.Sequential(
            torch.nn.Conv2d(3, 16, 3, stride=2, padding=1), torch.nn.ReLU(),
            torch.nn.Conv2d(16, 32, 3, stride=2, padding=1), torch.nn.ReLU(),
            torch.nn.Conv2d(32, 64, 3, padding=1), torch.nn.ReLU(),
            torch.nn.Conv2d(64, 3 * 4 * LEVELS, 1))
        self.guide = torch.nn.Sequential(torch.nn.Conv2d(3, 8, 1), torch.nn.ReLU(), torch.nn.Conv2d(8, 1, 1),
                                         torch.nn.Sigmoid())
        with torch.no_grad():  # initially the identity
            last = self.features[-1]
            last.weight.mul_(0.1)
            last.bias.copy_(torch.eye(3, 4)[..., None].expand(3, 4, LEVELS).flatten())

    def forward(self, images):
        small = F.interpolate(images, size=(LOW, LOW), mode="bilinear", align_corners=False)
        grid = self.features(small).view(len(images), 3, 4, LEVELS, CELLS, CELLS)
        return self.slicing(images, self.guide(images)[:, 0], grid)


def retouched(images):
    """The target: brighter shadows, and more local contrast."""
    around = F.avg_pool2d(F.pad(images, [16] * 4, mode="replicate"), 33, 1)
    return (images.clamp(min=1e-3) ** 0.7 + 0.4 * (images - around)).clamp(0, 1)


def pixels_of(path):
    """[height, width, channels], upright."""
    from PIL import Image, ImageOps

    try:
        with Image.open(path) as picture:
            return numpy.asarray(ImageOps.exif_transpose(picture))
    except OSError as error:
        raise SystemExit(f"cannot train: every photograph is a whole picture; {path}: {error}. Fetch it again.") from None


def photographs(folder):
    paths = sorted(Path(folder).glob("*.jpg"))
    if not paths:
        raise SystemExit(f"cannot train: {folder} holds no photographs (*.jpg). Name another folder with --images.")
    for path in paths:
        pixels = pixels_of(path)
        if pixels.ndim == 3:
            yield torch.from_numpy(numpy.ascontiguousarray(pixels[..., :3].transpose(2, 0, 1))).float() / 255


def batches(pictures, options):
    """Random crops, the same in every run."""
    generator = torch.Generator().manual_seed(options.seed)

    def draw(most):
        return int(torch.randint(most, (1,), generator=generator))

    while True:
        crops = []
        for _ in range(options.batch):
            picture = pictures[draw(len(pictures))]
            top, left = (draw(n - options.size + 1) for n in picture.shape[1:])
            crops.append(picture[:, top:top + options.size, left:left + options.size])
        yield torch.stack(crops)


class Training:
    def __init__(self, slicing, pictures, options):
        torch.manual_seed(options.seed)
        self.model, self.batches = Retoucher(slicing), batches(pictures, options)
        self.optimizer = torch.optim.Adam(self.model.parameters(), lr=2e-3)
        self.losses, self.seconds = [], []

    def step(self):
        images = next(self.batches)
        targets = retouched(images)
        start = time.perf_counter()
        self.optimizer.zero_grad()
        loss = F.mse_loss(self.model(images), targets)
        loss.backward()
        self.optimizer.step()
        self.seconds.append(time.perf_counter() - start)
        self.losses.append(loss.item())


def report_of(trainings, options):
    a, b = (training.losses for training in trainings.values())
    apart = max(abs(p - q) / q for p, q in zip(a, b))
    return {"steps": options.steps, "size": options.size, "batch": options.batch, "threads": options.threads,
            "pytorch": torch.__version__, "largest_relative_difference_of_losses": apart,
            **{name: {"ms_per_step": 1e3 * statistics.median(t.seconds[1:] or t.seconds), "losses": t.losses}
               for name, t in trainings.items()}}


def plot(report, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (curves, bars) = pyplot.subplots(1, 2, figsize=(10, 4), width_ratios=[2, 1])
    names = {"pipeline": "slicing by a pipeline", "pytorch_alone": "slicing by PyTorch"}
    for (key, name), style in zip(names.items(), ("-", "--")):
        curves.semilogy(report[key]["losses"], style, label=name)
    curves.set_xlabel("step")
    curves.set_ylabel("mean squared error")
    curves.legend()
    bars.bar(list(names.values()), [report[key]["ms_per_step"] for key in names])
    bars.set_ylabel("ms for a step")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def options_of(program, output, **defaults):
    """A parser with the options of training."""
    parser = argparse.ArgumentParser(description=program, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--images", default=str(Path(__file__).resolve().parents[1] / "images"))
    parser.add_argument("--output", default=output)
    for name, value in {"steps": 300, "size": 256, "batch": 4, "threads": 2, "seed": 1, **defaults}.items():
        parser.add_argument(f"--{name}", type=int, default=value)
    return parser


def large_enough(options):
    return [p for p in photographs(options.images) if min(p.shape[1:]) >= options.size]


def main():
    options = options_of(__doc__, "out/learned_retouching").parse_args()
    torch.set_num_threads(options.threads)
    pictures = large_enough(options)
    trainings = {"pipeline": Training(slice_by_pipeline, pictures, options),
                 "pytorch_alone": Training(slice_by_pytorch, pictures, options)}
    for at in range(options.steps):
        for training in list(trainings.values())[::1 if at % 2 else -1]:
            training.step()
    report = report_of(trainings, options)
    folder = Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.json").write_text(json.dumps(report, indent=1))
    plot(report, folder / "learned_retouching.png")
    ours, theirs = report["pipeline"], report["pytorch_alone"]
    print(f"loss {ours['losses'][0]:.5f} to {ours['losses'][-1]:.5f}, PyTorch alone to {theirs['losses'][-1]:.5f}; "
          f"a step takes {ours['ms_per_step']:.1f} ms, PyTorch alone {theirs['ms_per_step']:.1f} ms")


if __name__ == "__main__":
    main()
